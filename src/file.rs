//! Files that somebody names. Only plain files are opened: a named pipe would wait for somebody who writes, a device might never end.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// The file in `path`, for reading.
///
/// # Errors
///
/// [`io::ErrorKind::InvalidInput`] if it is no plain file; and what the system says.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?.file_type();
    let found = match kind {
        kind if kind.is_file() => return File::open(path),
        kind if kind.is_dir() => "a folder, not a file",
        _ => "a device or a named pipe, not a file",
    };
    Err(io::Error::new(io::ErrorKind::InvalidInput, found))
}
