//! Writes files into a folder together or not at all.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::draft::{DraftKind, TempFile, hold, sync_folder};
use super::whole::WriteError;

/// A folder of results.
#[derive(Debug, Clone, Default)]
pub struct ResultFolder {
    /// Names and contents. A name with folders in it requires that the target folder does not exist yet.
    pub written: Vec<(String, Vec<u8>)>,
    /// Names of files of an earlier result that this one does not have.
    pub removed: Vec<String>,
}

/// Writes files into a folder: all of them, or the folder stays unchanged.
///
/// The folder is created if its parent exists; other files in it stay. The files are written to a hidden folder,
/// synced, and then moved.
///
/// # Errors
///
/// The parent does not exist, a file would replace a folder, or the system refused.
pub fn write_folder(folder: &Path, files: &ResultFolder) -> Result<(), WriteError> {
    let failed = |error| WriteError::Failed { path: folder.to_owned(), error };
    let draft = begin(folder)?;
    fill(draft.path(), files).map_err(failed)?;
    let draft = if folder.exists() {
        draft
    } else {
        match draft.publish(folder) {
            Ok(()) => return Ok(()),
            // Another run created the folder in the meantime, so the files go into that one.
            Err((draft, _)) if folder.is_dir() => draft,
            Err((_, error)) => return Err(failed(error)),
        }
    };
    // Two runs that write into one folder take turns, so that all files are of one run.
    let lock = File::open(folder).ok();
    if let Some(lock) = &lock {
        // If folders cannot be locked, the user must keep runs apart.
        let _ = lock.lock();
    }
    exchange(folder, draft.path(), files)?;
    sync_folder(folder);
    Ok(())
}

/// Checks whether files could be written into a folder, without changing it.
///
/// # Errors
///
/// Those of [`write_folder`] that can be detected in advance.
pub fn try_folder(folder: &Path) -> Result<(), WriteError> {
    begin(folder).map(drop)
}

/// A temporary folder inside the target, so that nothing is moved between file systems, or beside it if the target does
/// not exist yet.
fn begin(folder: &Path) -> Result<TempFile, WriteError> {
    let failed = |error| WriteError::Failed { path: folder.to_owned(), error };
    if folder.is_dir() {
        return TempFile::create(folder, OsStr::new("dgd"), DraftKind::Folder).map_err(failed);
    }
    if folder.exists() {
        return Err(WriteError::NotFolder { path: folder.to_owned() });
    }
    let (Some(name), parent) = (folder.file_name(), parent(folder)) else {
        return Err(failed(io::Error::from(io::ErrorKind::InvalidInput)));
    };
    if !parent.is_dir() {
        let (path, folder) = (folder.to_owned(), parent.to_owned());
        return Err(WriteError::NoFolder { path, folder });
    }
    TempFile::create(parent, name, DraftKind::Folder).map_err(failed)
}

fn fill(draft: &Path, files: &ResultFolder) -> io::Result<()> {
    files.written.iter().try_for_each(|(name, content)| {
        let path = draft.join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut file = File::create_new(path)?;
        file.write_all(content)?;
        file.sync_all()
    })
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Moves the files of a temporary folder into the target, and the old ones out; if one cannot be moved, all are moved
/// back.
fn exchange(folder: &Path, draft: &Path, files: &ResultFolder) -> Result<(), WriteError> {
    let written = || files.written.iter().map(|(name, _)| name);
    if let Some(name) = written().chain(&files.removed).find(|name| folder.join(name).is_dir()) {
        return Err(WriteError::IsFolder { path: folder.join(name) });
    }
    let mut moves: Vec<(PathBuf, PathBuf)> = Vec::new();
    for name in files.removed.iter().chain(written()).filter(|name| folder.join(name).exists()) {
        moves.push((folder.join(name), draft.join(format!("{name}.old"))));
    }
    for name in written() {
        moves.push((draft.join(name), folder.join(name)));
    }
    let _uninterrupted = hold();
    for (done, (from, to)) in moves.iter().enumerate() {
        if let Err(error) = fs::rename(from, to) {
            for (from, to) in moves[..done].iter().rev() {
                // A file that cannot be moved back stays in the temporary folder; the first error matters more.
                let _ = fs::rename(to, from);
            }
            return Err(WriteError::Failed { path: from.clone(), error });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(names: &[&str], content: &str) -> ResultFolder {
        let written = names.iter().map(|name| ((*name).to_owned(), content.into())).collect();
        ResultFolder { written, removed: vec!["stale".to_owned()] }
    }

    /// Names and contents, in order.
    fn found(folder: &Path) -> Vec<(String, String)> {
        let entries = fs::read_dir(folder).expect("the folder exists");
        let mut files: Vec<_> = entries
            .map(|entry| {
                let entry = entry.expect("an entry can be read");
                let name = entry.file_name().to_string_lossy().into_owned();
                (name, fs::read_to_string(entry.path()).unwrap_or_default())
            })
            .collect();
        files.sort();
        files
    }

    fn pairs(all: &[(&str, &str)]) -> Vec<(String, String)> {
        all.iter().map(|(name, content)| ((*name).to_owned(), (*content).to_owned())).collect()
    }

    #[test]
    fn a_new_folder_has_all_files_and_an_old_one_keeps_the_others() {
        let place = tempfile::tempdir().expect("a folder for the test");
        let folder = place.path().join("out");
        write_folder(&folder, &files(&["a", "b"], "1")).expect("the folder is writable");
        assert_eq!(found(&folder), pairs(&[("a", "1"), ("b", "1")]));
        assert_eq!(found(place.path()), pairs(&[("out", "")]));
        for (name, content) in [("mine", "m"), ("stale", "s")] {
            fs::write(folder.join(name), content).expect("the folder is writable");
        }
        write_folder(&folder, &files(&["b", "c"], "2")).expect("the folder is writable");
        let expected = pairs(&[("a", "1"), ("b", "2"), ("c", "2"), ("mine", "m")]);
        assert_eq!(found(&folder), expected);
    }

    #[test]
    fn a_failure_leaves_the_folder_as_it_was() {
        let place = tempfile::tempdir().expect("a folder for the test");
        let folder = place.path().join("out");
        write_folder(&folder, &files(&["a"], "1")).expect("the folder is writable");
        fs::create_dir(folder.join("b")).expect("the folder is writable");
        let error = write_folder(&folder, &files(&["a", "b"], "2")).expect_err("`b` is a folder");
        assert!(matches!(error, WriteError::IsFolder { .. }));
        // An invalid file name fails while the temporary folder is filled.
        let error = write_folder(&folder, &files(&["a", "x/y"], "2")).expect_err("no such folder");
        assert!(matches!(error, WriteError::Failed { .. }));
        assert_eq!(found(&folder), pairs(&[("a", "1"), ("b", "")]));
        let lost = place.path().join("no").join("where");
        let error = write_folder(&lost, &files(&["a"], "1")).expect_err("no parent");
        assert!(matches!(error, WriteError::NoFolder { .. }));
        assert_eq!(found(place.path()), pairs(&[("out", "")]));
    }
}
