//! Atomic file writes: a file is complete or absent.
//!
//! The bytes are written to a temporary file, synced and renamed; then the folder is synced. A process that is killed in between leaves the
//! temporary file, which [`sweep`] removes.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Age from which a temporary file of another machine counts as abandoned, by the clock of the file system. Chosen: a write takes seconds.
const ABANDONED: Duration = Duration::from_secs(24 * 60 * 60);

/// Attempts to write a file whose temporary file vanishes, which happens if another machine treats a running process as dead.
const ATTEMPTS: u32 = 3;

/// A failed step of a write.
#[derive(Debug)]
pub struct Unwritten {
    /// The attempted action.
    pub action: &'static str,
    /// The cause.
    pub source: io::Error,
}

/// Writes `bytes` to `path`. An incomplete file never has this name, even after a power cut.
///
/// # Errors
///
/// A file that cannot be written.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Unwritten> {
    write_by(path, bytes, |temporary, path| fs::rename(temporary, path))
}

/// Writes `bytes` to `path` in the same way, but never replaces a file: returns `false` if there is one.
///
/// # Errors
///
/// A file that cannot be written.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<bool, Unwritten> {
    let link = |temporary: &Path, path: &Path| match fs::hard_link(temporary, path) {
        Ok(()) => fs::remove_file(temporary),
        // Some file systems have no hard links.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists && !path.exists() => fs::rename(temporary, path),
        Err(error) => Err(error),
    };
    match write_by(path, bytes, link) {
        Err(Unwritten { action: RENAME, .. }) if path.exists() => Ok(false),
        written => written.map(|()| true),
    }
}

fn write_by(path: &Path, bytes: &[u8], place: impl Fn(&Path, &Path) -> io::Result<()>) -> Result<(), Unwritten> {
    let failed = |action, source| Unwritten { action, source };
    let fill = |file: &mut File| file.write_all(bytes).map_err(|source| failed("write", source));
    let mut attempt = 1;
    loop {
        match publish(path, fill, &place, failed) {
            Err(Unwritten { action: RENAME, source })
                if source.kind() == io::ErrorKind::NotFound && attempt < ATTEMPTS =>
            {
                attempt += 1;
            }
            done => return done,
        }
    }
}

/// Writes a file durably; `fill` writes the content.
///
/// # Errors
///
/// The error of `fill`, or of the file system.
#[cfg(feature = "cli")]
pub fn write_with<E: From<io::Error>>(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), E>) -> Result<(), E> {
    publish(path, fill, |temporary, path| fs::rename(temporary, path), |_, source| source.into())
}

const RENAME: &str = "rename the temporary file";

fn publish<E>(
    path: &Path,
    fill: impl FnOnce(&mut File) -> Result<(), E>,
    place: impl Fn(&Path, &Path) -> io::Result<()>,
    failed: impl Fn(&'static str, io::Error) -> E,
) -> Result<(), E> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
        return Err(failed("write", io::Error::new(io::ErrorKind::InvalidInput, "not the path of a file")));
    };
    let (temporary, mut file) = create(folder, &name.to_string_lossy()).map_err(|error| failed("create", error))?;
    // A lock marks the file as in use for other processes of this machine. Without locks its age decides.
    let _ = file.try_lock();
    let written = fill(&mut file)
        .and_then(|()| file.sync_all().map_err(|error| failed("sync", error)))
        .and_then(|()| place(&temporary, path).map_err(|error| failed(RENAME, error)))
        .and_then(|()| sync_folder(folder).map_err(|error| failed("sync the folder", error)));
    if written.is_err() {
        // The first error is reported; a remaining temporary file is harmless.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// Creates a unique temporary file for `name`: its name contains machine, process and, if necessary, a number.
fn create(folder: &Path, name: &str) -> io::Result<(PathBuf, File)> {
    let (machine, process) = (machine(), std::process::id());
    let mut number = 0_u32;
    loop {
        let temporary = folder.join(format!(".{name}.{process}-{number}@{machine}{SUFFIX}"));
        match File::create_new(&temporary) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number < u32::MAX => number += 1,
            created => return created.map(|file| (temporary, file)),
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
        let abandoned = if name.ends_with(&ours) {
            match File::open(entry.path()).map(|file| file.try_lock()) {
                Ok(Ok(())) => true,
                Ok(Err(TryLockError::WouldBlock)) => false,
                _ => is_old(&entry, now),
            }
        } else {
            is_old(&entry, now)
        };
        if abandoned {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn is_old(entry: &fs::DirEntry, now: SystemTime) -> bool {
    let written = entry.metadata().and_then(|metadata| metadata.modified());
    written.is_ok_and(|written| now.duration_since(written).is_ok_and(|age| age > ABANDONED))
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
pub fn time(folder: &Path, bytes: usize) -> io::Result<Duration> {
    let folder = nearest_folder(folder);
    let content = vec![0; bytes];
    let start = Instant::now();
    let (temporary, mut file) = create(&folder, "plan")?;
    let written = file.write_all(&content).and_then(|()| file.sync_all()).and_then(|()| sync_folder(&folder));
    let time = start.elapsed();
    fs::remove_file(&temporary)?;
    written.map(|()| time)
}

/// Creates `folder` and its missing parents, each durably.
///
/// # Errors
///
/// A folder that cannot be created.
pub fn create_folder(folder: &Path) -> io::Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    let above = folder.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if above != Path::new(".") {
        create_folder(above)?;
    }
    match fs::create_dir(folder) {
        // Another process was faster.
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => Ok(()),
        created => created.and_then(|()| sync_folder(above)),
    }
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
        let (dead, _) = create(folder.path(), "dead").expect("is writable");
        let (living, file) = create(folder.path(), "living").expect("is writable");
        file.lock().expect("can be locked");
        let foreign = folder.path().join(".part-000000.parquet.1-0@elsewhere.tmp");
        fs::write(&foreign, "").expect("is writable");
        fs::write(folder.path().join(".mine.tmp"), "").expect("is writable");
        let shown = |path: &Path| path.file_name().expect("has a name").to_string_lossy().into_owned();
        sweep(folder.path(), now);
        assert!(!dead.exists());
        assert_eq!(names(folder.path()), [shown(&living), ".mine.tmp".to_owned(), shown(&foreign)]);
        sweep(folder.path(), now + ABANDONED + Duration::from_secs(60));
        assert_eq!(names(folder.path()), [shown(&living), ".mine.tmp".to_owned()]);
        drop(file);
        sweep(folder.path(), now);
        assert_eq!(names(folder.path()), [".mine.tmp"]);
    }

    #[test]
    fn names_that_are_taken_are_left_alone() {
        let folder = tempfile::tempdir().expect("is writable");
        let (first, mut file) = create(folder.path(), "x").expect("is writable");
        file.write_all(b"first").expect("is writable");
        write(&folder.path().join("x"), b"second").expect("is writable");
        assert_eq!(fs::read(first).expect("is readable"), b"first");
        assert_eq!(fs::read(folder.path().join("x")).expect("is readable"), b"second");
    }
}
