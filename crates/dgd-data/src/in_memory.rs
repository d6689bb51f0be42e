//! In-memory texts and tables, for browsers, editors and programs.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use dgd_compiler::syntax::imports::verify_import;

use crate::columns::DataColumns;
use crate::open::{FileSystem, FolderEntry};

/// In-memory files by path; paths are compared after `.` and `..` are resolved.
#[derive(Debug, Clone, Default)]
pub struct InMemory {
    all: BTreeMap<PathBuf, FileContents>,
}

/// The contents of a file.
#[derive(Debug, Clone)]
enum FileContents {
    Bytes(Arc<[u8]>),
    Columns(Arc<DataColumns>),
}

impl InMemory {
    /// Adds a file, or replaces the one with this path.
    #[must_use]
    pub fn with_file(mut self, path: impl AsRef<Path>, contents: impl Into<Vec<u8>>) -> Self {
        self.all.insert(plain(path.as_ref()), FileContents::Bytes(contents.into().into()));
        self
    }

    /// Adds a table, or replaces the file with this path.
    #[must_use]
    pub fn with_columns(mut self, path: impl AsRef<Path>, columns: DataColumns) -> Self {
        self.all.insert(plain(path.as_ref()), FileContents::Columns(Arc::new(columns)));
        self
    }

    /// Adds the files of another one, which replace those with equal paths.
    #[must_use]
    pub fn and(mut self, others: InMemory) -> Self {
        self.all.extend(others.all);
        self
    }

    /// Paths and texts, in order of path; tables are left out.
    pub fn texts(&self) -> impl Iterator<Item = (&Path, &[u8])> {
        self.all.iter().filter_map(|(path, contents)| match contents {
            FileContents::Bytes(bytes) => Some((path.as_path(), &**bytes)),
            FileContents::Columns(_) => None,
        })
    }
}

impl FileSystem for InMemory {
    fn open(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        match self.all.get(&plain(path)) {
            Some(FileContents::Bytes(bytes)) => Ok(Box::new(Cursor::new(Arc::clone(bytes)))),
            Some(FileContents::Columns(columns)) => Ok(Box::new(Cursor::new(columns.to_csv()))),
            None if self.is_folder(path) => Err("it is a folder".to_owned()),
            None => Err("there is no such file".to_owned()),
        }
    }

    fn open_import(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        verify_import(path)?;
        self.open(path)
    }

    fn entries(&self, folder: &Path) -> Vec<FolderEntry> {
        let base = plain(folder);
        let mut entries: Vec<FolderEntry> = (self.all.keys())
            .filter_map(|path| {
                let mut inside = path.strip_prefix(&base).ok()?.components();
                let name = inside.next()?;
                Some(FolderEntry { path: folder.join(name), is_folder: inside.next().is_some() })
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

    fn columns(&self, path: &Path) -> Option<Arc<DataColumns>> {
        match self.all.get(&plain(path))? {
            FileContents::Columns(columns) => Some(Arc::clone(columns)),
            FileContents::Bytes(_) => None,
        }
    }
}

/// Files of two layers: a path missing above is looked up below.
///
/// A folder above hides the one below, so that a copied folder stays consistent.
#[derive(Debug, Clone, Copy)]
pub struct LayeredFiles<'a> {
    /// The first layer.
    pub above: &'a dyn FileSystem,
    /// The second layer.
    pub below: &'a dyn FileSystem,
}

impl LayeredFiles<'_> {
    fn of_file(&self, path: &Path) -> &dyn FileSystem {
        if self.above.is_file(path) { self.above } else { self.below }
    }
}

impl FileSystem for LayeredFiles<'_> {
    fn open(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        self.of_file(path).open(path)
    }

    fn open_import(&self, path: &Path) -> Result<Box<dyn Read>, String> {
        self.of_file(path).open_import(path)
    }

    fn entries(&self, folder: &Path) -> Vec<FolderEntry> {
        let layer = if self.above.is_folder(folder) { self.above } else { self.below };
        layer.entries(folder)
    }

    fn is_file(&self, path: &Path) -> bool {
        self.above.is_file(path) || self.below.is_file(path)
    }

    fn is_folder(&self, path: &Path) -> bool {
        self.above.is_folder(path) || self.below.is_folder(path)
    }

    fn columns(&self, path: &Path) -> Option<Arc<DataColumns>> {
        self.of_file(path).columns(path)
    }

    fn file(&self, path: &Path) -> Option<File> {
        self.of_file(path).file(path)
    }
}

/// A path without `.`, and without `..` after a name.
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
            .with_file("models/a.dgd", "let a = 1\n")
            .with_file("models/effects/b.dgd", "")
            .with_file("models/effects/c/d.dgd", "");
        let read = |path: &str| read_text(&files, Path::new(path));
        assert_eq!(read("./models/parts/../a.dgd").as_deref(), Ok("let a = 1\n"));
        assert_eq!(read("a.dgd"), Err("there is no such file".to_owned()));
        assert_eq!(read("models"), Err("it is a folder".to_owned()));
        let refused = read_import(&files, Path::new("models/a.txt"));
        assert!(refused.is_err_and(|why| why.contains("only regular")));
        let entry = |path: &str, is_folder| FolderEntry { path: path.into(), is_folder };
        let expected = vec![entry("models/effects/b.dgd", false), entry("models/effects/c", true)];
        assert_eq!(files.entries(Path::new("models/effects")), expected);
        assert!(files.is_folder(Path::new("")) && !files.is_folder(Path::new("model")));
    }

    #[test]
    fn a_layer_above_hides_files_and_folders_below() {
        let above = InMemory::default().with_file("m.dgd", "new").with_file("effects/a.dgd", "");
        let below = InMemory::default()
            .with_file("m.dgd", "old")
            .with_file("effects/b.dgd", "")
            .with_file("lib/c.dgd", "c")
            .with_columns("data", DataColumns::default());
        let files = LayeredFiles { above: &above, below: &below };
        let read = |path: &str| read_text(&files, Path::new(path));
        assert_eq!(read("m.dgd").as_deref(), Ok("new"));
        assert_eq!(read("lib/c.dgd").as_deref(), Ok("c"));
        assert!(read("effects/a.dgd").is_ok() && read("none").is_err());
        let only_above = vec![FolderEntry { path: "effects/a.dgd".into(), is_folder: false }];
        assert_eq!(files.entries(Path::new("effects")), only_above);
        assert!(files.is_folder(Path::new("lib")) && !files.is_folder(Path::new("x")));
        assert!(files.columns(Path::new("data")).is_some());
        assert!(files.columns(Path::new("m.dgd")).is_none());
    }
}
