//! The files of an editor's project: open ones with the editor's text, others as on disk.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::names::NameTable;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::imports;
use flate2::read::MultiGzDecoder;

/// Maximum number of files of a project, and depth of folders, so that a home folder is not searched completely.
const MOST_FILES: usize = 2000;
const DEEPEST: usize = 8;

/// Open documents by path, and the folders opened in the editor.
#[derive(Debug, Default)]
pub(crate) struct OpenDocuments {
    pub(crate) open: BTreeMap<String, String>,
    pub(crate) folders: Vec<String>,
}

impl OpenDocuments {
    /// The text of a file.
    pub(crate) fn read(&self, path: &str) -> Result<String, String> {
        match self.open.get(path) {
            Some(text) => Ok(text.clone()),
            None if Path::new(path).extension().is_some_and(|end| end == "gz") => {
                let file = fs::File::open(path).map_err(|error| error.to_string())?;
                let mut text = String::new();
                let read = MultiGzDecoder::new(file).read_to_string(&mut text);
                read.map(|_| text).map_err(|error| error.to_string())
            }
            None => fs::read_to_string(path).map_err(|error| error.to_string()),
        }
    }

    /// Whether there is a file.
    pub(crate) fn is_file(&self, path: &str) -> bool {
        self.open.contains_key(path) || Path::new(path).is_file()
    }

    /// The names in all files of the project, and in files imported from elsewhere. The file `first` comes first.
    pub(crate) fn names(&self, first: &str) -> (NameTable, SourceMap) {
        let mut paths = vec![first.to_owned()];
        let mut add = |path: String| {
            if !paths.contains(&path) && paths.len() < MOST_FILES {
                paths.push(path);
            }
        };
        self.open.keys().for_each(|path| add(path.clone()));
        let beside = Path::new(first).parent().map(Path::to_path_buf);
        let mut folders: Vec<PathBuf> = match self.folders.as_slice() {
            [] => beside.into_iter().collect(),
            folders => folders.iter().map(PathBuf::from).collect(),
        };
        // An effect belongs to a model above its folder, which may be the only folder opened in the editor.
        let effects = Path::new(first).ancestors().find(|folder| folder.ends_with("effects"));
        folders.extend(effects.and_then(Path::parent).map(Path::to_path_buf));
        for folder in folders {
            collect(&folder, 0, &mut add);
        }
        let source =
            |path: String| self.read(&path).ok().map(|text| SourceText { name: path, text });
        let files: Vec<SourceText> = paths.into_iter().filter_map(source).collect();
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let mut read = |path: &str| self.read(path);
        let loaded = imports::load(files, &mut read, &mut sources, &mut diagnostics);
        (NameTable::collect(&loaded.asts, &sources), sources)
    }
}

fn collect(folder: &Path, depth: usize, add: &mut dyn FnMut(String)) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let is_left_out =
            |name: &str| name.starts_with('.') || matches!(name, "target" | "node_modules");
        if path.is_dir() {
            if depth < DEEPEST && !name.is_some_and(|name| is_left_out(&name)) {
                collect(&path, depth + 1, add);
            }
        } else if path.extension().is_some_and(|ending| ending == "dgd") {
            add(path.display().to_string());
        }
    }
}
