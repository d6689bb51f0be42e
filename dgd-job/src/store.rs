//! Where results lie: a folder that any number of processes and machines share.
//!
//! ```text
//!   DIR/fleet.json           the build and the type of machine whose results these are, written once
//!   DIR/done/ab/abcd….json   the result of the piece of this name
//!   DIR/failed/ab/abcd….json why it has none
//! ```
//!
//! A file is there whole or not at all, and says by being there that the piece is done. So it is asked for, and nobody
//! has to be told.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use dgd_data::files::{WriteError, make_folder, remove_left_over, write_first, write_shared};
use dgd_work::json_text;
use serde_json::json;

use crate::identity::Identity;
use crate::job::JobError;

/// What has become of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It has a result.
    Done,
    /// Its result says why there is none.
    Failed,
}

impl State {
    /// The folder with such results.
    pub fn name(self) -> &'static str {
        match self {
            State::Done => "done",
            State::Failed => "failed",
        }
    }
}

/// The results of a fleet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Store {
    folder: PathBuf,
}

/// The file that says whose results these are.
const FLEET: &str = "fleet.json";

/// First hexadecimal digits of a name that name the folder of the result: a folder has few enough files then.
const SHARD: usize = 2;

impl Store {
    /// Opens the results of this build, and makes the folder where there is none.
    ///
    /// # Errors
    ///
    /// The results there are of another build or another type of machine; or the system refused.
    pub fn open(folder: &Path, identity: &Identity) -> Result<Store, JobError> {
        let store = Store { folder: folder.to_owned() };
        let refused = |error: WriteError| JobError(error.to_string());
        make_folder(folder).map_err(refused)?;
        let path = folder.join(FLEET);
        if !path.exists() {
            let text = json_text(&json!({ "fleet": 1, "identity": identity }));
            write_first(&path, text.as_bytes()).map_err(refused)?;
        }
        let there = store.identity()?;
        match there.as_ref().and_then(|there| identity.difference(there)) {
            None => Ok(store),
            Some(difference) => Err(JobError(format!(
                "this is {difference}, of which the results in `{}` are: give another folder to `--into`, or do the \
                 rest with that build",
                folder.display()
            ))),
        }
    }

    /// Looks at results that are there, of whatever build.
    pub fn at(folder: &Path) -> Store {
        Store { folder: folder.to_owned() }
    }

    /// Whose results they are; nothing where there are none yet.
    ///
    /// # Errors
    ///
    /// The file is there and cannot be read.
    pub fn identity(&self) -> Result<Option<Identity>, JobError> {
        let path = self.folder.join(FLEET);
        if !path.exists() {
            return Ok(None);
        }
        let said = |what: String| JobError(format!("`{}`: {what}", path.display()));
        let text = fs::read_to_string(&path).map_err(|error| said(error.to_string()))?;
        let value: serde_json::Value =
            serde_json::from_str(&text).map_err(|error| said(error.to_string()))?;
        let identity = serde_json::from_value(value["identity"].clone());
        identity.map(Some).map_err(|error| said(error.to_string()))
    }

    /// The file of a result.
    pub fn path(&self, name: &str, state: State) -> PathBuf {
        let shard = name.get(..SHARD).unwrap_or(name);
        self.folder.join(state.name()).join(shard).join(format!("{name}.json"))
    }

    /// Whether a piece has a result. One that failed before and is done now is done.
    pub fn state(&self, name: &str) -> Option<State> {
        [State::Done, State::Failed].into_iter().find(|state| self.path(name, *state).exists())
    }

    /// The text of a result.
    pub fn read(&self, name: &str) -> Option<(State, String)> {
        [State::Done, State::Failed]
            .into_iter()
            .find_map(|state| Some((state, fs::read_to_string(self.path(name, state)).ok()?)))
    }

    /// Puts a result there, whole or not at all.
    ///
    /// # Errors
    ///
    /// The system refused.
    pub fn put(&self, name: &str, state: State, text: &str) -> Result<(), WriteError> {
        let path = self.path(name, state);
        if let Some(folder) = path.parent() {
            make_folder(folder)?;
        }
        write_shared(&path, text.as_bytes())?;
        if state == State::Done {
            // What it failed with before.
            let _ = fs::remove_file(self.path(name, State::Failed));
        }
        Ok(())
    }

    /// All pieces that have a result.
    pub fn all(&self) -> BTreeMap<String, State> {
        let mut all = BTreeMap::new();
        for state in [State::Failed, State::Done] {
            for folder in self.shards(state) {
                for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
                    let name = entry.file_name();
                    let name = name.to_str().and_then(|name| name.strip_suffix(".json"));
                    if let Some(name) = name.filter(|name| !name.starts_with('.')) {
                        all.insert(name.to_owned(), state);
                    }
                }
            }
        }
        all
    }

    /// Removes what processes left half written that were ended, where the piece has a result by now.
    pub fn tidy(&self) {
        remove_left_over(&self.folder);
        for state in [State::Failed, State::Done] {
            self.shards(state).iter().for_each(|folder| remove_left_over(folder));
        }
    }

    fn shards(&self, state: State) -> Vec<PathBuf> {
        let entries = fs::read_dir(self.folder.join(state.name())).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity(build: &str) -> Identity {
        let text = |text: &str| text.to_owned();
        Identity {
            version: text("1"),
            build: text(build),
            platform: text("p"),
            arithmetic: text("a"),
        }
    }

    #[test]
    fn results_are_found_by_name_and_done_counts_before_failed() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let at = folder.path().join("deep").join("results");
        let store = Store::open(&at, &identity("b")).expect("it is made");
        let (one, two) = ("00112233445566778899aabbccddeeff", "ff112233445566778899aabbccddeeff");
        assert_eq!((store.state(one), store.read(one)), (None, None));
        store.put(one, State::Failed, "no\n").expect("writable");
        store.put(two, State::Done, "yes\n").expect("writable");
        let states =
            BTreeMap::from([(one.to_owned(), State::Failed), (two.to_owned(), State::Done)]);
        assert_eq!(store.all(), states);
        store.put(one, State::Done, "after all\n").expect("writable");
        assert_eq!(store.read(one), Some((State::Done, "after all\n".to_owned())));
        assert!(!store.path(one, State::Failed).exists());
        // A draft is not a result.
        let torn = store.path(two, State::Done).with_file_name(format!(".{two}.json.host-1-0.tmp"));
        fs::write(&torn, "y").expect("writable");
        assert_eq!(store.all().len(), 2);
        store.tidy();
        assert!(!torn.exists());
    }

    #[test]
    fn results_of_another_build_are_not_mixed_with() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        Store::open(folder.path(), &identity("one")).expect("it is made");
        Store::open(folder.path(), &identity("one")).expect("it is the same");
        let refused = Store::open(folder.path(), &identity("two")).expect_err("it is another");
        assert!(refused.0.contains("another build") && refused.0.contains("--into"), "{refused}");
        let there = Store::at(folder.path()).identity().expect("it is read");
        assert_eq!(there, Some(identity("one")), "which anybody may look at");
    }
}
