//! Temporary files and folders: hidden beside their target, synced before they are renamed, and removed on Ctrl-C, or
//! by the next run if their process is gone.
//!
//! A temporary file is named `.NAME.dgd-PID-N.tmp`. Its writer holds a lock on it, which ends with the process in any
//! case, so a file without a lock whose process is gone is abandoned.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The temporary files of this process. While the lock is held, none can be created, published or removed.
static DRAFTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The kind of the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DraftKind {
    File,
    Folder,
}

/// A temporary file or folder; removed when dropped, unless it was published.
#[derive(Debug)]
pub(crate) struct TempFile {
    path: PathBuf,
    /// Holds the lock. Some systems cannot open folders.
    lock: Option<File>,
    published: bool,
}

impl TempFile {
    /// Creates a temporary file in the folder, named after its target.
    pub(crate) fn create(folder: &Path, name: &OsStr, kind: DraftKind) -> io::Result<TempFile> {
        remove_abandoned(folder, name);
        let mut attempt = 0_u32;
        loop {
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".dgd-{}-{attempt}.tmp", std::process::id()));
            let path = folder.join(hidden);
            let mut drafts = drafts();
            let made = match kind {
                DraftKind::File => File::create_new(&path).map(Some),
                DraftKind::Folder => fs::create_dir(&path).map(|()| File::open(&path).ok()),
            };
            match made {
                Ok(lock) => {
                    drafts.push(path.clone());
                    if let Some(file) = &lock {
                        // If files cannot be locked here, other processes cannot take the lock either.
                        let _ = file.try_lock();
                    }
                    // Another run may have removed it as abandoned before it was locked.
                    if path.exists() {
                        return Ok(TempFile { path, lock, published: false });
                    }
                    drafts.pop();
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
            attempt += 1;
            if attempt > 1000 {
                return Err(io::ErrorKind::AlreadyExists.into());
            }
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The open file.
    pub(crate) fn file(&self) -> io::Result<&File> {
        self.lock.as_ref().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    /// Syncs it and renames it to its target.
    pub(crate) fn publish(mut self, goal: &Path) -> Result<(), (TempFile, io::Error)> {
        let synced = self.lock.as_ref().map_or(Ok(()), File::sync_all);
        // A folder that cannot be synced contains synced files.
        if let Err(error) = synced
            && self.path.is_file()
        {
            return Err((self, error));
        }
        let mut drafts = drafts();
        if let Err(error) = fs::rename(&self.path, goal) {
            drop(drafts);
            return Err((self, error));
        }
        self.published = true;
        drafts.retain(|path| *path != self.path);
        drop(drafts);
        if let Some(folder) = goal.parent() {
            sync_folder(folder);
        }
        Ok(())
    }
}

impl Drop for TempFile {
    fn drop(&mut self) {
        if !self.published {
            let mut drafts = drafts();
            remove(&self.path);
            drafts.retain(|path| *path != self.path);
        }
    }
}

fn drafts() -> MutexGuard<'static, Vec<PathBuf>> {
    DRAFTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A leftover that cannot be removed is hidden, and the next run tries again.
fn remove(path: &Path) {
    let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Removes the temporary files of this process and prevents new ones: the process is about to end.
pub fn abandon() -> impl Drop {
    let drafts = drafts();
    drafts.iter().for_each(|path| remove(path));
    drafts
}

/// Prevents Ctrl-C from interrupting several renames.
pub(crate) fn hold() -> impl Drop {
    drafts()
}

/// Makes renames durable. Not every system can sync a folder, but the files in it are safe.
pub(crate) fn sync_folder(folder: &Path) {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// Removes abandoned temporary files in a folder: those of any target by this version, and those of this target by
/// older versions.
fn remove_abandoned(folder: &Path, name: &OsStr) {
    let name = name.to_string_lossy();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let file_name = entry.file_name();
        let Some(process) = file_name.to_str().and_then(|found| process_of(found, &name)) else {
            continue;
        };
        if process == std::process::id() || is_alive(process) {
            continue;
        }
        let path = entry.path();
        // Never a link, and nothing that would block when opened.
        let is_ours = entry.file_type().is_ok_and(|kind| kind.is_file() || kind.is_dir());
        let is_locked = || {
            File::open(&path)
                .is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
        };
        if is_ours && !is_locked() {
            remove(&path);
        }
    }
}

/// The process in the name of a temporary file.
fn process_of(found: &str, name: &str) -> Option<u32> {
    let inner = found.strip_prefix('.')?.strip_suffix(".tmp")?;
    let (of, numbers) = inner.rsplit_once('.')?;
    let numbers = match numbers.strip_prefix("dgd-") {
        Some(numbers) => numbers,
        None if of == name => numbers,
        None => return None,
    };
    let (process, attempt) = numbers.split_once('-')?;
    attempt.parse::<u32>().ok()?;
    process.parse().ok()
}

/// Whether a process with this number is known to run. If that cannot be determined, the lock decides.
fn is_alive(process: u32) -> bool {
    Path::new("/proc/self").exists() && Path::new(&format!("/proc/{process}")).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drafts_of_processes_that_are_gone_are_removed_and_no_others() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = |name: &str| folder.path().join(name);
        // Process numbers are below 2²².
        let gone = [".a.csv.4194999-0.tmp", ".a.csv.dgd-4194999-3.tmp", ".b.csv.dgd-4194999-0.tmp"];
        let kept = [
            ".b.csv.4194999-0.tmp",
            ".a.csv.dgd-4194999-x.tmp",
            ".a.csv.4194999.tmp",
            "a.csv.dgd-4194999-0.tmp",
            ".a.csv.dgd-4194999-0.tmp.csv",
        ];
        for name in gone.iter().chain(&kept) {
            fs::write(path(name), b"x").expect("the folder is writable");
        }
        fs::create_dir(path(".out.dgd-4194999-0.tmp")).expect("the folder is writable");
        let locked = File::create(path(".c.dgd-4194999-0.tmp")).expect("the folder is writable");
        locked.try_lock().expect("nobody else has it");
        let alive = format!(".a.csv.dgd-{}-7.tmp", std::process::id());
        fs::write(path(&alive), b"x").expect("the folder is writable");

        let draft = TempFile::create(folder.path(), OsStr::new("a.csv"), DraftKind::File);
        drop(draft.expect("the folder is writable"));
        for name in gone.iter().chain(&[".out.dgd-4194999-0.tmp"]) {
            assert!(!path(name).exists(), "{name}");
        }
        for name in kept.iter().chain(&[".c.dgd-4194999-0.tmp", &alive]) {
            assert!(path(name).exists(), "{name}");
        }
    }
}
