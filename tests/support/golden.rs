//! Files that hold what is expected. `UPDATE_GOLDEN=1 cargo test` writes them anew; what changed is
//! then reviewed like code.

#![allow(dead_code, reason = "not every test binary uses all of it")]

use std::fs;
use std::path::{Path, PathBuf};

/// Compares texts with files and collects what differs.
#[derive(Default)]
pub(crate) struct Goldens {
    differences: Vec<String>,
}

impl Goldens {
    /// Compares a text with a file, or writes the file when asked to.
    pub(crate) fn compare(&mut self, path: &Path, actual: &str) {
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            fs::write(path, actual).expect("the golden files can be written");
            return;
        }
        let expected = fs::read_to_string(path).unwrap_or_default().replace("\r\n", "\n");
        if expected == actual {
            return;
        }
        let same = expected.lines().zip(actual.lines()).take_while(|(e, a)| e == a).count();
        self.differences.push(format!(
            "{}:{}:\n  expected {:?}\n  found    {:?}",
            path.display(),
            same + 1,
            expected.lines().nth(same).unwrap_or("nothing"),
            actual.lines().nth(same).unwrap_or("nothing"),
        ));
    }

    /// Fails if anything differs.
    pub(crate) fn finish(self) {
        assert!(
            self.differences.is_empty(),
            "{}\n`UPDATE_GOLDEN=1 cargo test` writes these files anew",
            self.differences.join("\n")
        );
    }
}

/// The files of a folder with this ending, in order of name.
pub(crate) fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .expect("the folder is there")
        .map(|entry| entry.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|found| found == ending))
        .collect();
    files.sort();
    files
}
