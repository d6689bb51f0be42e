//! Texts that were never in a file: what a browser, an editor or a program made.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::open::{Entry, FileSystem, verify_import};

/// Files that exist only here, by their paths, which are compared after `.` and `..` were resolved.
#[derive(Debug, Clone, Default)]
pub struct InMemory {
    all: BTreeMap<PathBuf, Arc<[u8]>>,
}

impl InMemory {
    /// The same with one file more, in place of one that has this path.
    #[must_use]
    pub fn with(mut self, path: impl AsRef<Path>, contents: impl Into<Vec<u8>>) -> Self {
        self.all.insert(plain(path.as_ref()), contents.into().into());
        self
    }
}

impl FileSystem for InMemory {
    fn open(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        match self.all.get(&plain(path)) {
            Some(contents) => Ok(Box::new(Cursor::new(Arc::clone(contents)))),
            None if self.is_folder(path) => Err("it is a folder".to_owned()),
            None => Err("there is no such file".to_owned()),
        }
    }

    fn open_import(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        verify_import(path)?;
        self.open(path)
    }

    fn entries(&self, folder: &Path) -> Vec<Entry> {
        let own = plain(folder);
        let mut entries: Vec<Entry> = (self.all.keys())
            .filter_map(|path| {
                let mut inside = path.strip_prefix(&own).ok()?.components();
                let name = inside.next()?;
                Some(Entry { path: folder.join(name), is_folder: inside.next().is_some() })
            })
            .collect();
        entries.dedup();
        entries
    }

    fn is_file(&self, path: &Path) -> bool {
        self.all.contains_key(&plain(path))
    }

    fn is_folder(&self, path: &Path) -> bool {
        !self.entries(path).is_empty()
    }
}

/// A path without `.`, and without `..` behind a name.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::open::{read_import, read_text};

    #[test]
    fn files_are_found_by_what_their_paths_mean() {
        let files = InMemory::default()
            .with("models/a.dgd", "let a = 1\n")
            .with("models/effects/b.dgd", "")
            .with("models/effects/c/d.dgd", "");
        let read = |path: &str| read_text(&files, Path::new(path));
        assert_eq!(read("./models/parts/../a.dgd").as_deref(), Ok("let a = 1\n"));
        assert_eq!(read("a.dgd"), Err("there is no such file".to_owned()));
        assert_eq!(read("models"), Err("it is a folder".to_owned()));
        assert!(read_import(&files, Path::new("models/a.csv")).is_err());
        let entry = |path: &str, is_folder| Entry { path: path.into(), is_folder };
        let expected = vec![entry("models/effects/b.dgd", false), entry("models/effects/c", true)];
        assert_eq!(files.entries(Path::new("models/effects")), expected);
        assert!(files.is_folder(Path::new("")) && !files.is_folder(Path::new("model")));
    }
}
