//! Opens files, but nothing that blocks or never ends, on disk or in memory.

use std::fmt::Debug;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use dgd_compiler::syntax::imports::verify_import;
use flate2::bufread::MultiGzDecoder;

use crate::columns::DataColumns;
use crate::encoding::not_text;

/// Size limit of a model, library or effect, in bytes.
const MOST_BYTES: u64 = 16 << 20;

/// Magic bytes of gzip files.
const PACKED: [u8; 2] = [0x1f, 0x8b];

/// The path of standard input.
pub const STANDARD_INPUT: &str = "-";

/// Source of models, effects and recordings.
pub trait FileSystem: Debug + Sync {
    /// Opens a file that the user named.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be opened.
    fn open(&self, path: &Path) -> Result<Box<dyn Read>, String>;

    /// Opens a file named in another file: only `*.dgd`, or `*.csv` or `*.csv.gz` for a table.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be opened, without any of its contents.
    fn open_import(&self, path: &Path) -> Result<Box<dyn Read>, String>;

    /// The entries of a folder; empty if it cannot be read.
    fn entries(&self, folder: &Path) -> Vec<FolderEntry>;

    /// Whether the path is a regular file, which can be opened more than once.
    fn is_file(&self, path: &Path) -> bool;

    /// Whether the path is a folder.
    fn is_folder(&self, path: &Path) -> bool;

    /// A regular file on disk, for random access.
    fn file(&self, _path: &Path) -> Option<File> {
        None
    }

    /// A table held as columns; `open` gives its CSV text.
    fn columns(&self, _path: &Path) -> Option<Arc<DataColumns>> {
        None
    }
}

/// An entry of a folder.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct FolderEntry {
    /// Its path, including that of the folder.
    pub path: PathBuf,
    /// Whether it is a folder itself.
    pub is_folder: bool,
}

/// The files on disk.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DiskFiles;

impl FileSystem for DiskFiles {
    fn open(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        if path == Path::new(STANDARD_INPUT) {
            return Ok(Box::new(std::io::stdin()));
        }
        Ok(Box::new(open(path)?))
    }

    fn open_import(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        Ok(Box::new(open_import(path)?))
    }

    fn entries(&self, folder: &Path) -> Vec<FolderEntry> {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        // A dangling link does not count.
        let there = entries.map(|entry| entry.path()).filter(|path| path.exists());
        there.map(|path| FolderEntry { is_folder: path.is_dir(), path }).collect()
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn is_folder(&self, path: &Path) -> bool {
        path.is_dir()
    }

    fn file(&self, path: &Path) -> Option<File> {
        open(path).ok().filter(|_| path.is_file())
    }
}

/// Opens a file that the user named: a regular one, or a pipe that is already open, such as `<(…)` in a shell and
/// `/dev/stdin`.
///
/// # Errors
///
/// It is a folder, a device, a socket or a named pipe, or the system refused.
pub(crate) fn open(path: &Path) -> Result<File, String> {
    let kind = fs::metadata(path).map_err(|error| error.to_string())?.file_type();
    verify(path, kind)?;
    let file = File::open(path).map_err(|error| error.to_string())?;
    // The file may have been replaced since, but only by another permitted kind.
    verify(path, file.metadata().map_err(|error| error.to_string())?.file_type())?;
    Ok(file)
}

fn verify(path: &Path, kind: fs::FileType) -> Result<(), String> {
    if kind.is_file() {
        return Ok(());
    }
    if kind.is_dir() {
        return Err("it is a folder".to_owned());
    }
    special(path, kind)
}

#[cfg(unix)]
fn special(path: &Path, kind: fs::FileType) -> Result<(), String> {
    use std::os::unix::fs::FileTypeExt;
    if kind.is_fifo() {
        let is_open = path.starts_with("/dev/fd")
            || path.starts_with("/proc/self/fd")
            || path == Path::new("/dev/stdin");
        return if is_open { Ok(()) } else { Err("it is a named pipe".to_owned()) };
    }
    Err(if kind.is_socket() { "it is a socket" } else { "it is a device" }.to_owned())
}

#[cfg(not(unix))]
fn special(_: &Path, _: fs::FileType) -> Result<(), String> {
    Err("it is not a regular file".to_owned())
}

/// The text of a model, library or effect that the user named.
///
/// # Errors
///
/// It cannot be opened, is too large, or is not text.
pub fn read_text(files: &dyn FileSystem, path: &Path) -> Result<String, String> {
    text_of(files.open(path)?)
}

/// The text of a file named in another file.
///
/// # Errors
///
/// Those of [`read_text`], and of [`FileSystem::open_import`] for another name.
pub fn read_import(files: &dyn FileSystem, path: &Path) -> Result<String, String> {
    let mut file = BufReader::new(files.open_import(path)?);
    // An in-memory file may hold the decompressed text of a packed one.
    let is_packed = file.fill_buf().map_err(|error| error.to_string())?.starts_with(&PACKED);
    if is_packed { text_of(MultiGzDecoder::new(file)) } else { text_of(file) }
}

/// Opens a regular file with a permitted name, whose link target, if any, has one as well.
fn open_import(path: &Path) -> Result<File, String> {
    verify_import(path)?;
    let target = fs::canonicalize(path).map_err(|error| error.to_string())?;
    let is_regular = fs::metadata(&target).map_err(|error| error.to_string())?.is_file();
    // A file that is not regular is refused with the same message.
    verify_import(if is_regular { &target } else { Path::new("") })?;
    open(&target)
}

fn text_of(file: impl Read) -> Result<String, String> {
    let mut bytes = Vec::new();
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(format!("it is larger than {} MB", MOST_BYTES >> 20));
    }
    if let Some(why) = not_text(&bytes) {
        return Err(format!("{}; {}", why.message, why.help));
    }
    String::from_utf8(bytes).map_err(|error| {
        let sound = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = sound.split(|byte| *byte == b'\n').count();
        format!("line {line} is not UTF-8 text")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_have_a_largest_size() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("a.dgd");
        let file = File::create(&path).expect("the folder is writable");
        file.set_len(MOST_BYTES + 1).expect("there is room");
        for read in [read_text, read_import] {
            assert_eq!(read(&DiskFiles, &path), Err("it is larger than 16 MB".to_owned()));
        }
        assert_eq!(read_text(&DiskFiles, folder.path()), Err("it is a folder".to_owned()));
        assert!(read_import(&DiskFiles, folder.path()).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_to_files_of_the_same_kind_only() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("real.dgd"), "let a = 1\n").expect("the folder is writable");
        fs::write(path("secret"), "let a = 1\n").expect("the folder is writable");
        for (link, target) in [("1.dgd", "real.dgd"), ("2.dgd", "secret"), ("3.dgd", "/dev/zero")] {
            std::os::unix::fs::symlink(target, path(link)).expect("the folder is writable");
        }
        assert_eq!(read_import(&DiskFiles, &path("1.dgd")).as_deref(), Ok("let a = 1\n"));
        for link in ["2.dgd", "3.dgd", "secret"] {
            assert!(
                read_import(&DiskFiles, &path(link)).is_err_and(|why| why.contains("only regular")),
                "{link}"
            );
        }
        assert_eq!(read_text(&DiskFiles, Path::new("/dev/zero")), Err("it is a device".to_owned()));
    }
}
