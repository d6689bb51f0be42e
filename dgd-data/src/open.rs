//! What is opened: files, and not what blocks or never ends.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use crate::encoding::not_text;

/// Bytes of the largest model, library or effect.
const MOST_BYTES: u64 = 16 << 20;

/// Opens a file that the user named: a regular one, or a pipe that is open already, as `<(…)` of a shell
/// and `/dev/stdin` are.
///
/// # Errors
///
/// It is a folder, a device, a socket or a named pipe, or the system refused.
pub fn open(path: &Path) -> Result<File, String> {
    let kind = fs::metadata(path).map_err(|error| error.to_string())?.file_type();
    verify(path, kind)?;
    let file = File::open(path).map_err(|error| error.to_string())?;
    // What was opened is what was looked at, or another file of a kind that is read.
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
pub fn read_text(path: &Path) -> Result<String, String> {
    text_of(open(path)?)
}

/// The text of a file that another file names: a regular one called `*.dgd`, and so is what it links to.
/// Nothing else is opened.
pub fn read_import(path: &Path) -> Result<String, String> {
    let is_named = |path: &Path| path.extension().is_some_and(|ending| ending == "dgd");
    let refused = || "only regular files called `*.dgd` are read".to_owned();
    if !is_named(path) {
        return Err(refused());
    }
    let target = fs::canonicalize(path).map_err(|error| error.to_string())?;
    let is_regular = fs::metadata(&target).map_err(|error| error.to_string())?.is_file();
    if !(is_named(&target) && is_regular) {
        return Err(refused());
    }
    text_of(open(&target)?)
}

fn text_of(file: File) -> Result<String, String> {
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
            assert_eq!(read(&path), Err("it is larger than 16 MB".to_owned()));
        }
        assert_eq!(read_text(folder.path()), Err("it is a folder".to_owned()));
        assert!(read_import(folder.path()).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_to_files_of_the_same_kind_only() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("real.dgd"), "let a = 1\n").expect("the folder is writable");
        fs::write(at("secret"), "let a = 1\n").expect("the folder is writable");
        for (link, target) in [("1.dgd", "real.dgd"), ("2.dgd", "secret"), ("3.dgd", "/dev/zero")] {
            std::os::unix::fs::symlink(target, at(link)).expect("the folder is writable");
        }
        assert_eq!(read_import(&at("1.dgd")).as_deref(), Ok("let a = 1\n"));
        for link in ["2.dgd", "3.dgd", "secret"] {
            assert!(
                read_import(&at(link)).is_err_and(|why| why.contains("only regular")),
                "{link}"
            );
        }
        assert_eq!(read_text(Path::new("/dev/zero")), Err("it is a device".to_owned()));
    }
}
