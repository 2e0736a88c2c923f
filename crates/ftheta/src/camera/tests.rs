//! Cameras that are shell scripts.
#![cfg(unix)]

use super::*;
use ftheta_model::picture::Picture;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::sync::Mutex;
use tempfile::TempDir;

const FORMATS: &str = "\
ioctl: VIDIOC_ENUM_FMT
	Type: Video Capture

	[0]: 'MJPG' (Motion-JPEG, compressed)
		Size: Discrete 1920x1080
			Interval: Discrete 0.033s (30.000 fps)
		Size: Discrete 4000x3000
		Size: Discrete 640x480
	[1]: 'YUYV' (YUYV 4:2:2)
		Size: Discrete 8000x6000
";

/// Held while scripts are written and run: a file that is being written when another test starts
/// a program cannot be run itself.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A folder with a program that runs this script, and a picture beside it.
fn program(name: &str, script: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let picture = Picture::new(3, 2, vec![0.0, 0.2, 0.4, 0.6, 0.8, 1.0]).unwrap();
    fs::write(folder.path().join("picture"), picture_file::write_png(&picture)).unwrap();
    fs::write(folder.path().join("formats"), FORMATS).unwrap();
    let file = folder.path().join(name);
    let script = script.replace("HERE", &folder.path().display().to_string());
    fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&file, Permissions::from_mode(0o755)).unwrap();
    folder
}

#[test]
fn a_picture_is_taken_by_what_is_there() {
    let _guard = ONE_AT_A_TIME.lock().unwrap();
    for (device, name, script) in [
        ("/dev/video2", "ffmpeg", "case \"$*\" in *'-i /dev/video2 '*) cat HERE/picture;; esac"),
        (PI, "libcamera-still", "cat HERE/picture"),
        (
            "/dev/video0",
            "v4l2-ctl",
            "case \"$*\" in
               *list-formats-ext) cat HERE/formats;;
               *width=4000,height=3000,pixelformat=MJPG*) cat HERE/picture;;
             esac",
        ),
    ] {
        let folder = program(name, script);
        let read = take_by(device, folder.path().as_os_str()).unwrap();
        assert_eq!([read.picture.width(), read.picture.height()], [3, 2], "{name}");
    }
}

#[test]
fn what_is_missing_is_said() {
    let _guard = ONE_AT_A_TIME.lock().unwrap();
    let message = |device: &str, folder: &TempDir| {
        take_by(device, folder.path().as_os_str()).unwrap_err().to_string()
    };
    let none = program("something", "");
    assert_eq!(
        message("/dev/video0", &none),
        "none of the programs v4l2-ctl, ffmpeg is installed, which take pictures from \
         /dev/video0; install v4l-utils or ffmpeg, or take the picture in another way and give \
         its file"
    );
    let busy = program("ffmpeg", "echo 'Device or resource busy' >&2; exit 1");
    let expected = "ffmpeg takes no picture from /dev/video0: Device or resource busy";
    assert_eq!(message("/dev/video0", &busy), expected);
    let raw = program("v4l2-ctl", "echo \"[0]: 'YUYV' (YUYV 4:2:2)\"");
    assert!(message("/dev/video0", &raw).ends_with("the camera sends no JPEG"));
    let text = program("ffmpeg", "echo hello");
    assert!(message("/dev/video0", &text).contains("this is a text, expected a PNG"));
    let missing = take("/dev/no-such-video").unwrap_err().to_string();
    assert!(missing.starts_with("camera /dev/no-such-video is not there; "), "{missing}");
}

#[test]
fn cameras_are_listed_by_their_first_nodes() {
    let folder = tempfile::tempdir().unwrap();
    for (node, index, name) in [("video2", "0", "B\n"), ("video0", "0", "A"), ("video1", "1", "A")]
    {
        let node = folder.path().join(node);
        fs::create_dir(&node).unwrap();
        fs::write(node.join("index"), index).unwrap();
        fs::write(node.join("name"), name).unwrap();
    }
    let found = list_in(folder.path());
    let found: Vec<_> = found.iter().map(|c| (c.device.as_str(), c.name.as_str())).collect();
    assert_eq!(found, [("/dev/video0", "A"), ("/dev/video2", "B")]);
}
