//! Atomic files.

use std::error::Error;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::draft::{DraftKind, TempFile};

/// Writes a file with everything that `content` writes, or leaves it unchanged.
///
/// The text goes to a hidden file in the same folder, which then replaces `path`; after any failure it is removed. A
/// path that is not a regular file (a pipe, `/dev/null`) cannot be replaced and is written to directly.
///
/// # Errors
///
/// The folder does not exist, `path` is a folder, or writing failed, possibly in `content`.
pub fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |error| WriteError::Failed { path: path.to_owned(), error };
    let Some((draft, goal)) = begin(path)? else {
        let mut file = BufWriter::new(File::options().write(true).open(path).map_err(failed)?);
        return content(&mut file).and_then(|()| file.flush()).map_err(failed);
    };
    let mut file = BufWriter::new(draft.file().map_err(failed)?);
    content(&mut file).map_err(failed)?;
    file.into_inner().map_err(|error| failed(error.into_error()))?;
    // Keeps the permissions of the replaced file.
    if let Ok(existing) = fs::metadata(&goal) {
        fs::set_permissions(draft.path(), existing.permissions()).map_err(failed)?;
    }
    draft.publish(&goal).map_err(|(_, error)| failed(error))
}

/// Checks whether a file could be written, without changing it.
///
/// # Errors
///
/// Those of [`write_whole`] that can be detected in advance.
pub fn try_whole(path: &Path) -> Result<(), WriteError> {
    begin(path).map(drop)
}

/// A temporary file and its target path; `None` if the path is not that of a regular file.
fn begin(path: &Path) -> Result<Option<(TempFile, PathBuf)>, WriteError> {
    let failed = |error| WriteError::Failed { path: path.to_owned(), error };
    let goal = match fs::metadata(path) {
        Ok(existing) if existing.is_dir() => {
            return Err(WriteError::IsFolder { path: path.to_owned() });
        }
        Ok(existing) if !existing.is_file() => return Ok(None),
        Ok(existing) if existing.permissions().readonly() => {
            return Err(WriteError::IsProtected { path: path.to_owned() });
        }
        // A link stays a link: its target is replaced.
        Ok(_) => fs::canonicalize(path).map_err(failed)?,
        // A dangling link stays one as well: its target is created.
        Err(_) => fs::read_link(path)
            .map_or_else(|_| path.to_owned(), |target| path.with_file_name("").join(target)),
    };
    let Some(name) = goal.file_name() else {
        return Err(WriteError::IsFolder { path: path.to_owned() });
    };
    let folder = match goal.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let (path, folder) = (path.to_owned(), folder.to_owned());
        return Err(WriteError::NoFolder { path, folder });
    }
    let draft = TempFile::create(folder, name, DraftKind::File).map_err(failed)?;
    Ok(Some((draft, goal)))
}

/// Why a file could not be written. The file is unchanged.
#[derive(Debug)]
pub enum WriteError {
    /// Its folder does not exist.
    NoFolder {
        /// The file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// The path is that of a folder.
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// The path is not a folder.
    NotFolder {
        /// The path.
        path: PathBuf,
    },
    /// The file exists and is write-protected.
    IsProtected {
        /// The file.
        path: PathBuf,
    },
    /// The system refused.
    Failed {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        error: io::Error,
    },
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WriteError::NoFolder { path, folder } => write!(
                f,
                "cannot write `{}`: the folder `{}` does not exist",
                path.display(),
                folder.display()
            ),
            WriteError::IsFolder { path } => {
                write!(f, "cannot write `{}`: it is a folder", path.display())
            }
            WriteError::NotFolder { path } => {
                write!(f, "cannot write into `{}`: it is not a folder", path.display())
            }
            WriteError::IsProtected { path } => {
                write!(f, "cannot write `{}`: it is write-protected", path.display())
            }
            WriteError::Failed { path, error } => {
                write!(f, "cannot write `{}`: {error}", path.display())
            }
        }
    }
}

impl Error for WriteError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            WriteError::Failed { error, .. } => Some(error),
            WriteError::NoFolder { .. }
            | WriteError::IsFolder { .. }
            | WriteError::NotFolder { .. }
            | WriteError::IsProtected { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;

    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        let entries = fs::read_dir(folder).expect("the folder exists");
        let mut names: Vec<_> =
            entries.map(|entry| entry.expect("an entry can be read").file_name()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("a.csv");
        write_whole(&path, |out| out.write_all(b"old")).expect("the folder is writable");
        let failed = write_whole(&path, |out| {
            out.write_all("x".repeat(1 << 16).as_bytes())?;
            Err(io::Error::other("half way"))
        });
        assert!(failed.expect_err("it failed").to_string().ends_with("half way"));
        assert_eq!(fs::read(&path).expect("it is still there"), b"old");
        write_whole(&path, |out| out.write_all(b"new")).expect("the folder is writable");
        assert_eq!(fs::read(&path).expect("it was replaced"), b"new");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[test]
    fn a_folder_that_does_not_exist_is_named() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let missing = folder.path().join("runs");
        let error = write_whole(&missing.join("a.csv"), |_| Ok(())).expect_err("no such folder");
        assert!(matches!(&error, WriteError::NoFolder { folder, .. } if *folder == missing));
        let error = write_whole(folder.path(), |_| Ok(())).expect_err("a folder");
        assert!(matches!(error, WriteError::IsFolder { .. }));
        let error = write_whole(Path::new(""), |_| Ok(())).expect_err("no name");
        assert!(matches!(error, WriteError::IsFolder { .. } | WriteError::Failed { .. }));
    }

    #[test]
    fn a_protected_file_is_kept() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("a.csv");
        fs::write(&path, b"old").expect("the folder is writable");
        let writable = fs::metadata(&path).expect("it is there").permissions();
        let mut protected = writable.clone();
        protected.set_readonly(true);
        fs::set_permissions(&path, protected).expect("it is ours");
        let error = write_whole(&path, |out| out.write_all(b"new")).expect_err("it is protected");
        assert!(matches!(error, WriteError::IsProtected { .. }));
        assert_eq!(fs::read(&path).expect("it is still there"), b"old");
        fs::set_permissions(&path, writable).expect("it is ours");
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay_what_they_are() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let (real, link) = (folder.path().join("real.csv"), folder.path().join("link.csv"));
        fs::write(&real, b"old").expect("the folder is writable");
        std::os::unix::fs::symlink(&real, &link).expect("the folder is writable");
        write_whole(&link, |out| out.write_all(b"new")).expect("the folder is writable");
        assert_eq!(fs::read(&real).expect("it was replaced"), b"new");
        assert!(fs::symlink_metadata(&link).expect("the link is there").is_symlink());
        write_whole(Path::new("/dev/null"), |out| out.write_all(b"x")).expect("it takes all");
        let (goal, dangling) = (folder.path().join("goal.csv"), folder.path().join("dangling.csv"));
        std::os::unix::fs::symlink("goal.csv", &dangling).expect("the folder is writable");
        write_whole(&dangling, |out| out.write_all(b"x")).expect("the folder is writable");
        assert_eq!(fs::read(&goal).expect("it was made"), b"x");
        assert!(fs::symlink_metadata(&dangling).expect("the link is there").is_symlink());
    }
}
