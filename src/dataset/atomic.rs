//! Atomic file writes: a file is complete or absent.
//!
//! The bytes are written to a temporary file, synced and renamed; then the folder is synced. A process that is killed in between leaves the
//! temporary file, which [`sweep`] removes.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use tempfile::NamedTempFile;

use super::folder::{DatasetError, failed};
use crate::file::folder_of;

/// Age from which a temporary file of another machine is treated as abandoned, by the clock of the file system. Chosen: writing one takes seconds, and a day covers wrong clocks.
const MAX_TEMPORARY_AGE: Duration = Duration::from_secs(24 * 60 * 60);

/// Writes `bytes` to `path`. An incomplete file never has this name, even after a power cut.
///
/// # Errors
///
/// A file that cannot be written.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), DatasetError> {
    write_with(path, |file| file.write_all(bytes)).map_err(|error| failed(path, "write", error))
}

/// Writes `bytes` to `path` in the same way, but never replaces a file: returns `false` if there is one.
///
/// # Errors
///
/// A file that cannot be written.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<bool, DatasetError> {
    let write = || match filled(path, |file| file.write_all(bytes))?.persist_noclobber(path) {
        Ok(_) => sync_folder(folder_of(path)).map(|()| true),
        Err(_) if path.exists() => Ok(false),
        Err(error) => Err(error.error),
    };
    write().map_err(|error| failed(path, "write", error))
}

/// Writes a file in the same way; `fill` writes the content.
///
/// # Errors
///
/// The error of `fill`, or of the file system.
pub fn write_with<E: From<io::Error>>(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), E>) -> Result<(), E> {
    filled(path, fill)?.persist(path).map_err(|error| error.error)?;
    Ok(sync_folder(folder_of(path))?)
}

/// A temporary file for `path` with the content that `fill` writes, on the disk.
fn filled<E: From<io::Error>>(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), E>) -> Result<NamedTempFile, E> {
    let mut temporary = create(path)?;
    fill(temporary.as_file_mut())?;
    temporary.as_file().sync_all()?;
    Ok(temporary)
}

/// Creates a temporary file for `path` in its folder, which is removed unless it is renamed. Its name holds the machine; its lock shows
/// processes of this machine that it has an owner.
fn create(path: &Path) -> io::Result<NamedTempFile> {
    let prefix = format!(".{}.", path.file_name().unwrap_or_default().to_string_lossy());
    let suffix = format!("@{}{SUFFIX}", machine());
    loop {
        let temporary = tempfile::Builder::new()
            .prefix(&prefix)
            .suffix(&suffix)
            .make_in(folder_of(path), |path| File::create_new(path))?;
        match temporary.as_file().try_lock() {
            // Another process swept it away before it was locked.
            Err(TryLockError::WouldBlock) => {}
            Ok(()) if !temporary.path().exists() => {}
            // Without locks the age of the file decides.
            _ => return Ok(temporary),
        }
    }
}

/// The suffix of a temporary file.
const SUFFIX: &str = ".tmp";

/// The name of this machine, restricted to legal characters of file names.
fn machine() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let name: String =
        name.trim().chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
    if name.is_empty() { "localhost".to_owned() } else { name }
}

/// Whether `name` is the name of a temporary file of slipsweep.
pub fn is_temporary(name: &str) -> bool {
    name.starts_with('.') && name.ends_with(SUFFIX) && name.contains('@')
}

/// Removes the temporary files of ended processes in `folder`. `now` is the time by the clock of the file system.
///
/// A process holds a lock on its temporary file as long as it runs. Locks may not reach other machines, so a file of another machine counts as
/// abandoned only when it is old. Files that cannot be removed are ignored, since they are harmless.
pub fn sweep(folder: &Path, now: SystemTime) {
    let ours = format!("@{}{SUFFIX}", machine());
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        // Opening a named pipe would wait for a writer.
        if !is_temporary(&name) || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        // The lock lasts until the file is removed, so that no process that is creating it loses it.
        let file = File::open(entry.path());
        let abandoned = match file.as_ref().map(File::try_lock) {
            Ok(Ok(())) if name.ends_with(&ours) => true,
            Ok(Err(TryLockError::WouldBlock)) => false,
            _ => is_old(&entry, now),
        };
        if abandoned {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn is_old(entry: &fs::DirEntry, now: SystemTime) -> bool {
    let written = entry.metadata().and_then(|metadata| metadata.modified());
    written.is_ok_and(|written| now.duration_since(written).is_ok_and(|age| age > MAX_TEMPORARY_AGE))
}

/// The nearest existing folder at or above `folder`, which is on the same disk.
pub fn nearest_folder(folder: &Path) -> PathBuf {
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let there = absolute.ancestors().find(|folder| folder.is_dir());
    there.unwrap_or(Path::new(".")).to_owned()
}

/// Seconds to write a file of `bytes` bytes into `folder`. The file is removed again.
///
/// # Errors
///
/// A file that cannot be written.
pub fn time(folder: &Path, bytes: usize) -> Result<Duration, DatasetError> {
    let path = nearest_folder(folder).join("plan");
    let content = vec![0; bytes];
    let start = Instant::now();
    let written = filled(&path, |file| file.write_all(&content)).and_then(|_file| sync_folder(folder_of(&path)));
    written.map(|()| start.elapsed()).map_err(|error| failed(&path, "write", error))
}

/// Creates `folder` and its missing parents, each durably.
///
/// # Errors
///
/// A folder that cannot be created.
pub fn create_folder(folder: &Path) -> Result<(), DatasetError> {
    let missing: Vec<&Path> = folder.ancestors().take_while(|folder| !folder.is_dir()).collect();
    let created = fs::create_dir_all(folder);
    let synced = created.and_then(|()| missing.iter().try_for_each(|folder| sync_folder(folder_of(folder))));
    synced.map_err(|error| failed(folder, "create the folder", error))
}

#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// On other systems a folder cannot be opened as a file, and renaming is durable without a sync.
#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    //! Removal of temporary files, and the processes that own them.

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("is readable");
        let mut names: Vec<_> =
            entries.map(|entry| entry.expect("is readable").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn files_of_the_dead_are_swept_and_those_of_the_living_stay() {
        let folder = tempfile::tempdir().expect("is writable");
        let now = SystemTime::now();
        let dead = create(&folder.path().join("dead")).expect("is writable").into_temp_path();
        let living = create(&folder.path().join("living")).expect("is writable");
        let foreign = folder.path().join(".part-000000.parquet.1-0@elsewhere.tmp");
        fs::write(&foreign, "").expect("is writable");
        fs::write(folder.path().join(".mine.tmp"), "").expect("is writable");
        let shown = |path: &Path| path.file_name().expect("has a name").to_string_lossy().into_owned();
        sweep(folder.path(), now);
        assert!(!dead.exists());
        assert_eq!(names(folder.path()), [shown(living.path()), ".mine.tmp".to_owned(), shown(&foreign)]);
        sweep(folder.path(), now + MAX_TEMPORARY_AGE + Duration::from_secs(60));
        assert_eq!(names(folder.path()), [shown(living.path()), ".mine.tmp".to_owned()]);
        drop(living);
        assert_eq!(names(folder.path()), [".mine.tmp"]);
    }

    /// A process that swept the folder between creation and lock removed the file of another one.
    #[test]
    fn regress_a_sweep_removes_no_file_that_is_being_created() {
        let folder = tempfile::tempdir().expect("is writable");
        let is_done = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !is_done.load(std::sync::atomic::Ordering::Relaxed) {
                    sweep(folder.path(), SystemTime::now());
                }
            });
            let path = folder.path().join("x");
            let lost = (0..5000).filter(|_| !create(&path).expect("is writable").path().exists()).count();
            is_done.store(true, std::sync::atomic::Ordering::Relaxed);
            assert_eq!(lost, 0);
        });
    }
}
