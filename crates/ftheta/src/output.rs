//! Writes results so that no file is ever left looking whole when it is not.

use crate::Error;
use ftheta_formats::{picture_file, plan_file};
use ftheta_model::picture::Picture;
use ftheta_physics::plan::Plan;
use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Files of a result, written beside their places; [`Output::publish`] puts them there.
pub struct Output {
    folder: PathBuf,
    pending: Vec<(NamedTempFile, PathBuf)>,
}

/// Writes one file whole; its folder is made if need be.
///
/// # Errors
/// If it cannot be written.
pub fn write_file(path: &Path, content: &[u8]) -> Result<(), Error> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let mut output = Output::new(folder.unwrap_or(Path::new(".")))?;
    output.add(&name, |out| out.write_all(content))?;
    output.publish()
}

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// As PNG.
    Png,
    /// As JPEG of this quality, 1 to 100.
    Jpeg(u8),
}

impl PictureFormat {
    /// The format that a file's name asks for.
    ///
    /// # Errors
    /// If it ends neither as PNG nor as JPEG.
    pub fn of(path: &Path, quality: u8) -> Result<Self, Error> {
        let extension = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
        match extension.as_ref().and_then(|extension| extension.to_str()) {
            Some("png") => Ok(Self::Png),
            Some("jpg" | "jpeg") => Ok(Self::Jpeg(quality)),
            _ => Err(Error::Format { path: path.into(), expected: ".png or .jpg" }),
        }
    }
}

/// Writes a picture, grey with 256 shades.
///
/// # Errors
/// If it cannot be written, or is too long for JPEG.
pub fn write_picture(picture: &Picture, path: &Path, format: PictureFormat) -> Result<(), Error> {
    let bytes = match format {
        PictureFormat::Png => picture_file::write_png(picture),
        PictureFormat::Jpeg(quality) => picture_file::write_jpeg(picture, quality)
            .ok_or_else(|| Error::Format { path: path.into(), expected: ".png for its size" })?,
    };
    write_file(path, &bytes)
}

impl Output {
    /// Files for a folder, which is made if need be.
    ///
    /// # Errors
    /// If the folder cannot be made or written to.
    pub fn new(folder: &Path) -> Result<Self, Error> {
        let io = |source| Error::Io { path: folder.into(), action: "write to", source };
        fs::create_dir_all(folder).map_err(io)?;
        // Fails now, and not after minutes of planning.
        NamedTempFile::new_in(folder).map_err(io)?;
        Ok(Self { folder: folder.into(), pending: Vec::new() })
    }

    /// Where a file of this name will be.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes a file under a temporary name.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    ) -> Result<(), Error> {
        let path = self.path(name);
        let io = |source| Error::Io { path: path.clone(), action: "write", source };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".ftheta-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // The usual mode less the umask, not the private one of temporary files.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(&self.folder).map_err(io)?;
        let mut buffered = BufWriter::new(file);
        write(&mut buffered).map_err(io)?;
        let file = buffered.into_inner().map_err(|error| io(error.into_error()))?;
        file.as_file().sync_all().map_err(io)?;
        self.pending.push((file, path));
        Ok(())
    }

    /// Writes a plan file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add_plan(&mut self, name: &str, plan: &Plan) -> Result<(), Error> {
        self.add(name, |mut out| plan_file::write(plan, &plan.id().to_string(), &mut out))
    }

    /// Gives all files their names, in the order in which they were written.
    ///
    /// # Errors
    /// If a file cannot be renamed; those before it have their names.
    pub fn publish(self) -> Result<(), Error> {
        for (file, path) in self.pending {
            file.persist(&path).map_err(|error| Error::Io {
                path,
                action: "write",
                source: error.error,
            })?;
        }
        Ok(())
    }
}
