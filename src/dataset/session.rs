//! A run that writes to a dataset. It publishes its manifest without replacing another one, and compares the current manifest before each part.
//!
//! The lock only gives an early message. The manifest guarantees that two specs never mix: the first one stays.

use std::fs::{self, File, TryLockError};
use std::path::Path;
use std::thread;
use std::time::{Duration, SystemTime};

use super::atomic;
use super::folder::{DatasetError, Folder, MISSING};
use super::manifest::Manifest;

/// Attempts to publish a manifest while another one appears and disappears. Chosen: each attempt fails only if another process does both in between.
const ATTEMPTS: usize = 4;

/// A run that writes to a dataset.
#[derive(Debug)]
pub struct Session {
    folder: Folder,
    /// The current manifest.
    pub manifest: Manifest,
    _lock: Option<Lock>,
}

/// Whether a run allows concurrent runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Concurrency {
    /// A run of the whole sweep, which excludes other runs.
    Alone,
    /// A shard; shards run at the same time, even the same shard after a requeue.
    Shards,
}

impl Folder {
    /// Prepares the folder for the parts of `planned`. An existing dataset with these tables stays unchanged; missing tables are added to it.
    ///
    /// # Errors
    ///
    /// If the folder contains something else, or another run writes to it.
    pub fn open(&self, planned: &Manifest, company: Concurrency) -> Result<Session, DatasetError> {
        self.settle(planned)?;
        atomic::create_folder(self.path())?;
        let lock = lock(self.path(), company)?;
        let manifest = self.publish(planned)?;
        let now = SystemTime::now();
        atomic::sweep(self.path(), now);
        for table in &planned.tables {
            let folder = self.path().join(&table.name);
            atomic::create_folder(&folder)?;
            atomic::sweep(&folder, now);
        }
        let session = Session { folder: self.clone(), manifest, _lock: lock };
        session.check()?;
        Ok(session)
    }

    /// The manifest that the folder needs for `planned`, and the required action.
    fn settle(&self, planned: &Manifest) -> Result<(Manifest, ManifestAction), DatasetError> {
        let found = match self.manifest() {
            // Nothing is lost with it.
            Err(DatasetError::Manifest { .. }) if !self.has_parts() => {
                return Ok((planned.clone(), ManifestAction::Replace));
            }
            found => found?,
        };
        let Some(found) = found else {
            let is_visible = |entry: fs::DirEntry| !entry.file_name().to_string_lossy().starts_with('.');
            let occupied = fs::read_dir(self.path()).is_ok_and(|entries| entries.flatten().any(is_visible));
            return match self.read_manifest()? {
                // Another run has just published its manifest, which is its first file.
                Some(_) => self.settle(planned),
                None if occupied => Err(DatasetError::Occupied { folder: self.path().display().to_string() }),
                None => Ok((planned.clone(), ManifestAction::Create)),
            };
        };
        self.compare(planned, &found)?;
        let action = match found.rebuilt.as_deref() {
            None if found.covers(planned) => return Ok((found, ManifestAction::Keep)),
            Some(MISSING) => ManifestAction::Create,
            _ => ManifestAction::Replace,
        };
        let mut settled = if found.tables.len() > planned.tables.len() { found } else { planned.clone() };
        settled.rebuilt = None;
        if settled.spec.is_empty() {
            settled.spec.clone_from(&planned.spec);
        }
        Ok((settled, action))
    }

    /// Publishes the manifest for `planned`, and returns it.
    fn publish(&self, planned: &Manifest) -> Result<Manifest, DatasetError> {
        let path = self.manifest_path();
        for _ in 0..ATTEMPTS {
            let (manifest, action) = self.settle(planned)?;
            // A run that creates a manifest may find that another run was faster.
            let is_published = match action {
                ManifestAction::Keep => true,
                ManifestAction::Create => atomic::write_new(&path, &manifest.to_bytes())?,
                ManifestAction::Replace => atomic::write(&path, &manifest.to_bytes()).map(|()| true)?,
            };
            if is_published {
                return Ok(manifest);
            }
        }
        Err(self.taken("manifest.json appeared and disappeared"))
    }

    fn taken(&self, what: &'static str) -> DatasetError {
        DatasetError::Taken { folder: self.path().display().to_string(), what }
    }
}

/// The required action on a manifest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ManifestAction {
    /// The manifest is up to date.
    Keep,
    /// The manifest is rewritten: new tables, or damage.
    Replace,
    /// There is no manifest.
    Create,
}

impl Session {
    /// Writes a part atomically if the dataset still belongs to this run.
    ///
    /// # Errors
    ///
    /// A file that cannot be written, or a dataset that no longer belongs to this run.
    pub fn write_part(&self, table: &str, part: u64, bytes: &[u8]) -> Result<(), DatasetError> {
        self.check()?;
        atomic::write(&self.folder.part(table, part), bytes)
    }

    /// Compares the current manifest with that of this run.
    ///
    /// # Errors
    ///
    /// If it has been removed or replaced.
    pub fn check(&self) -> Result<(), DatasetError> {
        match self.folder.read_manifest() {
            Ok(Some(found)) if found.covers(&self.manifest) => Ok(()),
            Ok(None) => Err(self.folder.taken("manifest.json was removed")),
            _ => Err(self.folder.taken("manifest.json was replaced by another one")),
        }
    }
}

/// A lock on a folder, released when it is dropped.
///
/// Closing the file is not enough: a child process that another thread starts has a copy of the file until it executes
/// its program.
#[derive(Debug)]
struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // After a failure the lock lasts until the end of the process.
        let _ = self.0.unlock();
    }
}

/// The lock of a run on the folder of its dataset; `None` if folders cannot be locked.
fn lock(folder: &Path, company: Concurrency) -> Result<Option<Lock>, DatasetError> {
    let Ok(file) = File::open(folder) else { return Ok(None) };
    let locked = || match company {
        Concurrency::Alone => file.try_lock(),
        Concurrency::Shards => file.try_lock_shared(),
    };
    // `status` has a lock for an instant.
    let first = locked().inspect_err(|_| thread::sleep(LOCK_PAUSE));
    match first.or_else(|_| locked()) {
        Err(TryLockError::WouldBlock) => Err(DatasetError::Busy { folder: folder.display().to_string() }),
        _ => Ok(Some(Lock(file))),
    }
}

/// Pause before a second attempt to lock a folder. Chosen: much longer than the lock of `status`.
const LOCK_PAUSE: Duration = Duration::from_millis(20);

impl Folder {
    /// Whether a run of the whole sweep is writing to the dataset.
    pub fn is_busy(&self) -> bool {
        matches!(lock(self.path(), Concurrency::Shards), Err(DatasetError::Busy { .. }))
    }
}
