//! A camera of this computer: one picture from it, by a program that knows how.
//!
//! Talking to V4L2 directly needs unsafe code, which this workspace does without, and the crates
//! that wrap it generate their bindings with libclang when they are built. So a well-known program
//! is run, and what it writes is read as any picture file.

use ftheta_formats::picture_file::{self, PictureFileError, PictureRead};
use std::ffi::OsStr;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;
use thiserror::Error;

/// How long a program may take, s: cameras wake up slowly, and need some frames to find their
/// exposure.
const PATIENCE_S: u64 = 30;
/// Frames that are let go by until the exposure has settled.
const N_SKIP: u32 = 20;
/// Most bytes of a picture.
const N_BYTES_MAX: u64 = 256 << 20;
/// Name of a camera of a Raspberry Pi.
const PI: &str = "rpicam";

/// A camera of this computer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraDevice {
    /// What to give to [`take`], as `/dev/video0`.
    pub device: String,
    /// What it calls itself.
    pub name: String,
}

/// Why there is no picture from a camera.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraError {
    /// No such camera.
    #[error("camera {device} is not there; {}", known(.found))]
    NoDevice {
        /// What was asked for.
        device: String,
        /// What there is.
        found: Vec<CameraDevice>,
    },
    /// No program that takes pictures.
    #[error(
        "none of the programs {programs} is installed, which take pictures from {device}; install \
         {package}, or take the picture in another way and give its file"
    )]
    NoProgram {
        /// The camera.
        device: String,
        /// What was looked for.
        programs: String,
        /// What to install.
        package: &'static str,
    },
    /// The program says no.
    #[error("{program} takes no picture from {device}: {message}")]
    Failed {
        /// The program.
        program: String,
        /// The camera.
        device: String,
        /// The last line that it wrote.
        message: String,
    },
    /// The program does not come to an end.
    #[error("{program} has no picture from {device} after {limit_s} s; is it in use?")]
    Silent {
        /// The program.
        program: String,
        /// The camera.
        device: String,
        /// How long it was waited for, s.
        limit_s: u64,
    },
    /// What the program wrote is no picture.
    #[error("the picture from {device} cannot be used: {source}")]
    Picture {
        /// The camera.
        device: String,
        /// What is wrong.
        source: PictureFileError,
    },
}

fn known(found: &[CameraDevice]) -> String {
    match found {
        [] => "there is none, give a picture's file instead".into(),
        found => {
            let names = found.iter().map(|camera| format!("{} ({})", camera.device, camera.name));
            format!("there are {}", names.collect::<Vec<_>>().join(", "))
        }
    }
}

impl CameraError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::NoDevice { device, found } => ("--camera".into(), device.clone(), known(found)),
            Self::NoProgram { device, programs, package } => {
                (device.clone(), format!("none of {programs}"), (*package).into())
            }
            Self::Failed { program, device, message } => {
                (device.clone(), format!("{program}: {message}"), String::new())
            }
            Self::Silent { device, limit_s, .. } => {
                (device.clone(), "no picture".into(), format!("{limit_s} s"))
            }
            Self::Picture { device, source } => {
                let (place, value, limit) = source.fault();
                (format!("{device}: {place}"), value, limit)
            }
        }
    }
}

/// The cameras that the system knows; none where it has no `/sys/class/video4linux`.
pub fn list() -> Vec<CameraDevice> {
    list_in(Path::new("/sys/class/video4linux"))
}

fn list_in(folder: &Path) -> Vec<CameraDevice> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<CameraDevice> = entries
        .filter(|entry| {
            // A camera may have more nodes, which carry no pictures.
            let index = fs::read_to_string(entry.path().join("index")).unwrap_or_default();
            matches!(index.trim(), "" | "0")
        })
        .map(|entry| CameraDevice {
            device: format!("/dev/{}", entry.file_name().to_string_lossy()),
            name: fs::read_to_string(entry.path().join("name"))
                .map_or("camera".into(), |name| name.trim().into()),
        })
        .collect();
    found.sort_by(|a, b| a.device.cmp(&b.device));
    found
}

/// Takes one picture, at the camera's full size.
///
/// * `device`: `/dev/video0`, its number, or `rpicam` for the camera of a Raspberry Pi
///
/// # Errors
/// If there is no such camera, no program that takes pictures (`v4l2-ctl` or `ffmpeg`,
/// `rpicam-still` or `libcamera-still`), or no picture within half a minute.
pub fn take(device: &str) -> Result<PictureRead, CameraError> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let device = match device.parse::<u32>() {
        Ok(number) => format!("/dev/video{number}"),
        Err(_) => device.into(),
    };
    if device != PI && !Path::new(&device).exists() {
        return Err(CameraError::NoDevice { device, found: list() });
    }
    take_by(&device, &path)
}

/// The same by programs in the folders of a search path.
fn take_by(device: &str, path: &OsStr) -> Result<PictureRead, CameraError> {
    let (names, package): (&[&str], _) = match device {
        PI => (&["rpicam-still", "libcamera-still"], "rpicam-apps"),
        _ => (&["v4l2-ctl", "ffmpeg"], "v4l-utils or ffmpeg"),
    };
    let find = |name: &&str| {
        std::env::split_paths(path).map(|folder| folder.join(name)).find(|file| file.is_file())
    };
    let Some(program) = names.iter().find_map(find) else {
        let programs = names.join(", ");
        return Err(CameraError::NoProgram { device: device.into(), programs, package });
    };
    let skip = format!("--stream-skip={N_SKIP}");
    let select = format!("select=gte(n\\,{N_SKIP})");
    let of = format!("--device={device}");
    let bytes = match program.file_name().and_then(OsStr::to_str) {
        Some("v4l2-ctl") => {
            let formats = run(&program, device, &[&of, "--list-formats-ext"])?;
            let [width, height] = largest_jpeg(&String::from_utf8_lossy(&formats))
                .ok_or_else(|| failed(&program, device, "the camera sends no JPEG"))?;
            let format = format!("--set-fmt-video=width={width},height={height},pixelformat=MJPG");
            let stream = ["--stream-mmap", &skip, "--stream-count=1", "--stream-to=-"];
            run(&program, device, &[&[of.as_str(), &format][..], &stream].concat())?
        }
        Some("ffmpeg") => {
            let input = ["-hide_banner", "-loglevel", "error", "-f", "v4l2", "-i", device];
            let output = ["-vf", &select, "-frames:v", "1", "-c:v", "png", "-f", "image2pipe", "-"];
            run(&program, device, &[&input[..], &output].concat())?
        }
        _ => run(&program, device, &["--nopreview", "--encoding", "png", "--output", "-"])?,
    };
    let refused = |source| CameraError::Picture { device: device.into(), source };
    picture_file::read(&bytes).map_err(refused)
}

/// The largest size that a camera sends as JPEG, from what `v4l2-ctl --list-formats-ext` writes.
fn largest_jpeg(formats: &str) -> Option<[u32; 2]> {
    let mut is_jpeg = false;
    let mut largest = None;
    for line in formats.lines() {
        if let Some((_, format)) = line.split_once("]: '") {
            is_jpeg = format.starts_with("MJPG") || format.starts_with("JPEG");
        }
        let size = line.split_once("Size: Discrete ").and_then(|(_, size)| size.split_once('x'));
        if let (true, Some((width, height))) = (is_jpeg, size) {
            let size = [width.trim().parse().ok()?, height.trim().parse().ok()?];
            let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
            largest = largest.filter(|other| area(*other) >= area(size)).or(Some(size));
        }
    }
    largest
}

fn failed(program: &Path, device: &str, message: &str) -> CameraError {
    let (program, device) = (name(program), device.into());
    CameraError::Failed { program, device, message: message.into() }
}

fn name(program: &Path) -> String {
    program.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// What a program writes; it is ended if it takes too long.
fn run(program: &PathBuf, device: &str, arguments: &[&str]) -> Result<Vec<u8>, CameraError> {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| failed(program, device, &error.to_string()))?;
    let (send, receive) = mpsc::channel();
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    // What it complains of is read meanwhile, so that neither pipe fills up.
    let complaints = thread::spawn(move || read(stderr));
    thread::spawn(move || send.send(read(stdout)));
    let Ok(bytes) = receive.recv_timeout(Duration::from_secs(PATIENCE_S)) else {
        let _ = child.kill();
        let _ = child.wait();
        let (program, device) = (name(program), device.into());
        return Err(CameraError::Silent { program, device, limit_s: PATIENCE_S });
    };
    let status = child.wait().map_err(|error| failed(program, device, &error.to_string()))?;
    let complaints = complaints.join().unwrap_or_default();
    if !status.success() || bytes.is_empty() {
        let complaints = String::from_utf8_lossy(&complaints);
        let last = complaints.lines().rev().find(|line| !line.trim().is_empty());
        return Err(failed(program, device, last.unwrap_or("it wrote nothing").trim()));
    }
    Ok(bytes)
}

fn read(pipe: Option<impl Read>) -> Vec<u8> {
    let mut bytes = Vec::new();
    if let Some(pipe) = pipe {
        // What came before the end is all there is.
        let _ = pipe.take(N_BYTES_MAX).read_to_end(&mut bytes);
    }
    bytes
}

#[cfg(test)]
mod tests;
