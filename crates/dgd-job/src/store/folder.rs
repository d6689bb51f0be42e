//! A folder of results: each file is written to a temporary name, synced, and renamed.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use dgd_data::files::{WriteError, make_folder, remove_left_over, write_first, write_shared};

use super::{KeyValueStore, PieceState};
use crate::job::JobError;

/// A folder shared by processes.
#[derive(Debug)]
pub(super) struct SharedFolder {
    pub(super) folder: PathBuf,
}

impl SharedFolder {
    /// Reads a file that may be absent.
    fn found<T>(&self, key: &str, read: io::Result<T>) -> Result<Option<T>, JobError> {
        match read {
            Ok(found) => Ok(Some(found)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(JobError::Store { path: self.shown(key), reason: error.to_string() }),
        }
    }

    fn shards(&self, state: &str) -> Result<Vec<PathBuf>, JobError> {
        let entries = self.found(state, fs::read_dir(self.folder.join(state)))?;
        let entries = entries.into_iter().flatten().flatten();
        Ok(entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect())
    }

    /// Writes a file, and makes its folder if necessary.
    fn written(
        &self,
        key: &str,
        text: &str,
        write: fn(&Path, &[u8]) -> Result<(), WriteError>,
    ) -> Result<(), JobError> {
        let path = self.folder.join(key);
        if let Some(folder) = path.parent() {
            make_folder(folder).map_err(JobError::Write)?;
        }
        write(&path, text.as_bytes()).map_err(JobError::Write)
    }
}

impl KeyValueStore for SharedFolder {
    fn may_cut_off(&self) -> bool {
        true
    }

    fn read(&self, key: &str) -> Result<Option<String>, JobError> {
        // Invalid UTF-8 is not a document.
        let bytes = self.found(key, fs::read(self.folder.join(key)))?;
        Ok(bytes.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
    }

    fn has(&self, key: &str) -> Result<bool, JobError> {
        Ok(self.found(key, fs::metadata(self.folder.join(key)))?.is_some())
    }

    fn put_first(&self, key: &str, text: &str) -> Result<(), JobError> {
        self.written(key, text, |path, text| write_first(path, text).map(|_| ()))
    }

    fn put_same(&self, key: &str, text: &str) -> Result<(), JobError> {
        self.put(key, text)
    }

    fn put(&self, key: &str, text: &str) -> Result<(), JobError> {
        self.written(key, text, write_shared)
    }

    fn remove(&self, key: &str) -> Result<(), JobError> {
        self.found(key, fs::remove_file(self.folder.join(key))).map(|_| ())
    }

    fn keys(&self, begin: &str) -> Result<Vec<String>, JobError> {
        let mut keys = Vec::new();
        for shard in self.shards(begin)? {
            let entries = self.found(begin, fs::read_dir(&shard))?;
            for entry in entries.into_iter().flatten().flatten() {
                if let (Some(shard), Some(name)) =
                    (shard.file_name().and_then(|name| name.to_str()), entry.file_name().to_str())
                {
                    keys.push(format!("{begin}{shard}/{name}"));
                }
            }
        }
        Ok(keys)
    }

    fn tidy(&self) {
        remove_left_over(&self.folder);
        for state in [PieceState::Failed, PieceState::Done] {
            for shard in self.shards(state.name()).unwrap_or_default() {
                remove_left_over(&shard);
            }
        }
    }

    fn shown(&self, key: &str) -> PathBuf {
        self.folder.join(key)
    }
}
