//! Atomic files that several machines write into one folder, without locks and clocks.
//!
//! A file is written to a hidden temporary name beside it, `.NAME.HOST-PID-N.tmp`, synced and renamed, and then the
//! folder is synced. No process removes another's temporary file while the target is missing; once the target exists,
//! the temporary file is a leftover of a terminated process, which [`remove_left_over`] removes.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::draft::sync_folder;
use super::whole::WriteError;

/// Writes a file with exactly these bytes, or leaves it unchanged. A file that another process wrote meanwhile is
/// replaced atomically.
///
/// # Errors
///
/// The folder does not exist, or the system refused.
pub fn write_shared(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let failed = |error| WriteError::Failed { path: path.to_owned(), error };
    let draft = drafted(path, bytes).map_err(failed)?;
    match fs::rename(&draft, path) {
        Ok(()) => {}
        // It was removed as a leftover, because another process has written the file.
        Err(_) if path.exists() && !draft.exists() => return Ok(()),
        Err(error) => {
            let _ = fs::remove_file(&draft);
            return Err(failed(error));
        }
    }
    sync_folder(folder_of(path));
    Ok(())
}

/// Writes a file unless it exists; returns whether it did. Of several processes, only one succeeds.
///
/// # Errors
///
/// Those of [`write_shared`].
pub fn write_first(path: &Path, bytes: &[u8]) -> Result<bool, WriteError> {
    let failed = |error| WriteError::Failed { path: path.to_owned(), error };
    if path.exists() {
        return Ok(false);
    }
    let draft = drafted(path, bytes).map_err(failed)?;
    // A hard link fails atomically if the file exists.
    let linked = fs::hard_link(&draft, path);
    let linked = match linked {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        // A file system without hard links.
        Err(_) if !path.exists() => fs::rename(&draft, path).map(|()| true),
        other => other.map(|()| true),
    };
    let _ = fs::remove_file(&draft);
    sync_folder(folder_of(path));
    linked.map_err(failed)
}

/// Creates a folder and its parents durably.
///
/// # Errors
///
/// The system refused.
pub fn make_folder(path: &Path) -> Result<(), WriteError> {
    if path.is_dir() {
        return Ok(());
    }
    let failed = |error| WriteError::Failed { path: path.to_owned(), error };
    let above = folder_of(path);
    if !above.as_os_str().is_empty() {
        make_folder(above)?;
    }
    match fs::create_dir(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(failed(error)),
        _ => {}
    }
    sync_folder(above);
    Ok(())
}

/// Removes temporary files in a folder whose targets exist.
pub fn remove_left_over(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if file_of(&name).is_some_and(|file| folder.join(file).exists()) {
            // A leftover that cannot be removed is hidden.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A synced temporary file with these bytes.
fn drafted(path: &Path, bytes: &[u8]) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
    let mut attempt = 0_u32;
    let (draft, mut file) = loop {
        let mut hidden = OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}-{}-{attempt}.tmp", host(), std::process::id()));
        let draft = folder_of(path).join(hidden);
        match File::create_new(&draft) {
            Ok(file) => break (draft, file),
            // It is another thread's, or that of a terminated process with the same number.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && attempt < 1000 => {
                attempt += 1;
            }
            Err(error) => return Err(error),
        }
    };
    if let Err(error) = file.write_all(bytes).and_then(|()| file.sync_all()) {
        let _ = fs::remove_file(&draft);
        return Err(error);
    }
    Ok(draft)
}

/// The name of a temporary file's target.
fn file_of(draft: &OsStr) -> Option<&str> {
    let inner = draft.to_str()?.strip_prefix('.')?.strip_suffix(".tmp")?;
    let (name, writer) = inner.rsplit_once('.')?;
    let mut parts = writer.rsplit('-');
    let is_number = |part: Option<&str>| part.is_some_and(|part| part.parse::<u32>().is_ok());
    (is_number(parts.next()) && is_number(parts.next()) && parts.next().is_some()).then_some(name)
}

/// The name of this machine, without dots, to distinguish it from others that share a folder.
fn host() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = name.or_else(|| std::env::var("COMPUTERNAME").ok()).unwrap_or_default();
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.trim().chars().map(plain).collect();
    if name.is_empty() { "host".to_owned() } else { name }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or_else(|| Path::new(""))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").flatten();
        let mut names: Vec<String> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn of_many_writers_one_is_first_and_no_draft_stays() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("a").join("b").join("fleet.json");
        make_folder(folder_of(&path)).expect("the folder is writable");
        let first: Vec<bool> = std::thread::scope(|scope| {
            let write = |k: u8| {
                let path = &path;
                scope.spawn(move || write_first(path, &vec![k; 100_000]).expect("writable"))
            };
            let threads: Vec<_> = (0..8).map(write).collect();
            threads.into_iter().map(|thread| thread.join().expect("no panic")).collect()
        });
        assert_eq!(first.iter().filter(|first| **first).count(), 1);
        let bytes = fs::read(&path).expect("it is there");
        assert!(bytes.len() == 100_000 && bytes.iter().all(|byte| *byte == bytes[0]));
        assert!(first[usize::from(bytes[0])], "it is that of the one that was first");
        assert_eq!(names(folder_of(&path)), ["fleet.json"]);
    }

    #[test]
    fn left_overs_are_removed_once_their_file_is_there_and_no_other_file() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = |name: &str| folder.path().join(name);
        let kept =
            [".b.json.host-12-0.tmp", ".a.json.tmp", ".a.json.x-y.tmp", "a.json.host-1-0.tmp"];
        for name in kept.iter().chain(&[".a.json.my_host-7-0.tmp", ".a.json.host-7-3.tmp"]) {
            fs::write(path(name), b"torn").expect("the folder is writable");
        }
        remove_left_over(folder.path());
        assert_eq!(names(folder.path()).len(), 6, "`a.json` is missing: its draft may be at work");
        write_shared(&path("a.json"), b"whole").expect("the folder is writable");
        remove_left_over(folder.path());
        let mut expected: Vec<&str> = kept.into_iter().chain(["a.json"]).collect();
        expected.sort_unstable();
        assert_eq!(names(folder.path()), expected);
        assert_eq!(fs::read(path("a.json")).expect("it is there"), b"whole");
    }

    #[test]
    fn where_it_cannot_be_written_nothing_is() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let lost = folder.path().join("no").join("a.json");
        assert!(matches!(write_shared(&lost, b"x"), Err(WriteError::Failed { .. })));
        fs::create_dir(folder.path().join("a.json")).expect("the folder is writable");
        assert!(write_shared(&folder.path().join("a.json"), b"x").is_err());
        assert_eq!(names(folder.path()), ["a.json"]);
    }
}
