//! Files and folders under way: hidden beside what they will become, synced before they are renamed,
//! removed at Ctrl-C, and by the next run where the run that wrote them is gone.
//!
//! A draft is named `.NAME.dgd-PID-N.tmp`. Its writer holds a lock on it, which ends with the process
//! however that ends, so a draft without a lock whose process is gone belongs to nobody.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The drafts of this process. Who holds the lock keeps drafts from being made, published and removed.
static DRAFTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// What a draft will become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    File,
    Folder,
}

/// A file or folder under way; removed when dropped, unless it was published.
#[derive(Debug)]
pub(crate) struct Draft {
    path: PathBuf,
    /// Holds the lock. Folders cannot be opened everywhere.
    lock: Option<File>,
    published: bool,
}

impl Draft {
    /// A new draft in the folder, named after what it will become.
    pub(crate) fn create(folder: &Path, name: &OsStr, kind: Kind) -> io::Result<Draft> {
        remove_abandoned(folder, name);
        let mut attempt = 0_u32;
        loop {
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".dgd-{}-{attempt}.tmp", std::process::id()));
            let path = folder.join(hidden);
            let mut drafts = drafts();
            let made = match kind {
                Kind::File => File::create_new(&path).map(Some),
                Kind::Folder => fs::create_dir(&path).map(|()| File::open(&path).ok()),
            };
            match made {
                Ok(lock) => {
                    drafts.push(path.clone());
                    if let Some(file) = &lock {
                        // Where files cannot be locked, nobody else can take the lock either.
                        let _ = file.try_lock();
                    }
                    // Another run may have taken it for abandoned before the lock was there.
                    if path.exists() {
                        return Ok(Draft { path, lock, published: false });
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

    /// The file, to write to.
    pub(crate) fn file(&self) -> io::Result<&File> {
        self.lock.as_ref().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    /// Renames it, once all of it is on the disk.
    pub(crate) fn publish(mut self, goal: &Path) -> Result<(), (Draft, io::Error)> {
        let synced = self.lock.as_ref().map_or(Ok(()), File::sync_all);
        // A folder that cannot be synced has files that were.
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

impl Drop for Draft {
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

/// What cannot be removed is a hidden left-over, which the next run tries again.
fn remove(path: &Path) {
    let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Removes what this process has under way, and lets nothing new begin: the process is about to end.
pub fn abandon() -> impl Drop {
    let drafts = drafts();
    drafts.iter().for_each(|path| remove(path));
    drafts
}

/// Keeps Ctrl-C from coming between several renames.
pub(crate) fn hold() -> impl Drop {
    drafts()
}

/// Makes renames last. Not every system can sync a folder, and the files in it are safe.
pub(crate) fn sync_folder(folder: &Path) {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// Removes drafts in a folder whose processes are gone: those of any name that dgd made, and those of this
/// name that older versions made.
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
        // Never a link, and nothing that would block when it is opened.
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

/// The process whose draft has this name.
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

/// Whether a process of this number is known to run. Where that cannot be told, the lock tells.
fn is_alive(process: u32) -> bool {
    Path::new("/proc/self").exists() && Path::new(&format!("/proc/{process}")).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drafts_of_processes_that_are_gone_are_removed_and_no_others() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let at = |name: &str| folder.path().join(name);
        // Process numbers end at 2²².
        let gone = [".a.csv.4194999-0.tmp", ".a.csv.dgd-4194999-3.tmp", ".b.csv.dgd-4194999-0.tmp"];
        let kept = [
            ".b.csv.4194999-0.tmp",
            ".a.csv.dgd-4194999-x.tmp",
            ".a.csv.4194999.tmp",
            "a.csv.dgd-4194999-0.tmp",
            ".a.csv.dgd-4194999-0.tmp.csv",
        ];
        for name in gone.iter().chain(&kept) {
            fs::write(at(name), b"x").expect("the folder is writable");
        }
        fs::create_dir(at(".out.dgd-4194999-0.tmp")).expect("the folder is writable");
        let held = File::create(at(".c.dgd-4194999-0.tmp")).expect("the folder is writable");
        held.try_lock().expect("nobody else has it");
        let alive = format!(".a.csv.dgd-{}-7.tmp", std::process::id());
        fs::write(at(&alive), b"x").expect("the folder is writable");

        let draft = Draft::create(folder.path(), OsStr::new("a.csv"), Kind::File);
        drop(draft.expect("the folder is writable"));
        for name in gone.iter().chain(&[".out.dgd-4194999-0.tmp"]) {
            assert!(!at(name).exists(), "{name}");
        }
        for name in kept.iter().chain(&[".c.dgd-4194999-0.tmp", &alive]) {
            assert!(at(name).exists(), "{name}");
        }
    }
}
