//! Storage of results: a folder, or another place shared by processes and machines.
//!
//! ```text
//!   DIR/fleet.json           the build and platform of these results, written once
//!   DIR/done/ab/abcd….json   the result of the piece of this name
//!   DIR/failed/ab/abcd….json the reason why it has none
//! ```
//!
//! A file is either complete or absent, and its presence is the only record that a piece is done, so no process needs
//! to be notified. A file that is truncated nevertheless, by a full disk or an incomplete copy, does not count: its
//! piece is open, and computed again.

mod folder;

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use dgd_work::json_text;
use serde_json::json;

use crate::identity::BuildIdentity;
use crate::job::JobError;
use folder::SharedFolder;

/// A key–text store with keys like `done/ab/abcd….json`, in which each text is either complete or absent.
pub trait KeyValueStore: Debug + Send + Sync {
    /// Whether a text may be truncated, so that it must be read to check; not if the store itself keeps texts complete.
    fn may_cut_off(&self) -> bool {
        false
    }

    /// The text of a key; `None` if it is absent.
    ///
    /// # Errors
    ///
    /// The store cannot be read. The same applies to the other methods.
    fn read(&self, key: &str) -> Result<Option<String>, JobError>;

    /// Whether a key has a text.
    fn has(&self, key: &str) -> Result<bool, JobError>;

    /// Stores a text unless the key has one. If several callers do so, one wins, and all succeed.
    fn put_first(&self, key: &str, text: &str) -> Result<(), JobError>;

    /// Stores a text that equals the existing one, if there is one.
    fn put_same(&self, key: &str, text: &str) -> Result<(), JobError> {
        self.put_first(key, text)
    }

    /// Stores a text, replacing an existing one.
    fn put(&self, key: &str, text: &str) -> Result<(), JobError>;

    /// Removes a text, if there is one.
    fn remove(&self, key: &str) -> Result<(), JobError>;

    /// All keys with this prefix, unordered.
    fn keys(&self, begin: &str) -> Result<Vec<String>, JobError>;

    /// Removes incomplete files of processes that were terminated.
    fn tidy(&self) {}

    /// The location of a key, to be shown.
    fn shown(&self, key: &str) -> PathBuf;
}

/// Opens a store other than a folder by its name, which begins with its scheme.
pub type StoreOpener = fn(&str) -> Result<Arc<dyn KeyValueStore>, JobError>;

/// Prefix of the names of other stores.
const ELSEWHERE: &str = "s3://";

static OPENS: OnceLock<StoreOpener> = OnceLock::new();

/// Registers the function that opens `s3://` stores.
pub fn set_opens(opens: StoreOpener) {
    let _ = OPENS.set(opens);
}

/// Whether results are stored elsewhere than in a folder of this machine.
pub fn is_elsewhere(into: &Path) -> bool {
    into.to_str().is_some_and(|name| name.starts_with(ELSEWHERE))
}

fn place(into: &Path) -> Result<Arc<dyn KeyValueStore>, JobError> {
    let Some(name) = into.to_str().filter(|_| is_elsewhere(into)) else {
        return Ok(Arc::new(SharedFolder { folder: into.to_owned() }));
    };
    match OPENS.get() {
        Some(opens) => opens(name),
        None => Err(JobError::NoBuckets(name.to_owned())),
    }
}

/// The state of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PieceState {
    /// It has a result.
    Done,
    /// It failed; its document has the reason.
    Failed,
}

impl PieceState {
    /// The folder of such results.
    pub fn name(self) -> &'static str {
        match self {
            PieceState::Done => "done",
            PieceState::Failed => "failed",
        }
    }
}

/// The results of a fleet.
#[derive(Debug, Clone)]
pub struct FleetStore {
    place: Arc<dyn KeyValueStore>,
}

/// The file with the identity of the results.
const FLEET: &str = "fleet.json";

/// Length of the name's prefix that names the folder of a result, to limit the number of files in a folder.
const SHARD: usize = 2;

/// The key of a result.
fn key(name: &str, state: PieceState) -> String {
    let shard = name.get(..SHARD).unwrap_or(name);
    format!("{}/{shard}/{name}.json", state.name())
}

/// Whether a text is a complete document.
fn is_whole(text: &str) -> bool {
    serde_json::from_str::<serde::de::IgnoredAny>(text).is_ok()
}

impl FleetStore {
    /// Opens the store for results of this build, and creates the folder if necessary.
    ///
    /// # Errors
    ///
    /// The existing results are of another build or platform, or the system refused.
    pub fn open(into: &Path, identity: &BuildIdentity) -> Result<FleetStore, JobError> {
        let store = FleetStore::open_in(into)?;
        if !store.place.has(FLEET)? {
            let text = json_text(&json!({ "fleet": 1, "identity": identity }));
            store.place.put_first(FLEET, &text)?;
        }
        let there = store.identity()?;
        match there.as_ref().and_then(|there| identity.difference(there)) {
            None => Ok(store),
            Some(difference) => Err(JobError::OtherBuild { difference, into: into.to_owned() }),
        }
    }

    /// Opens existing results of any build.
    ///
    /// # Errors
    ///
    /// The store does not exist.
    pub fn open_in(into: &Path) -> Result<FleetStore, JobError> {
        Ok(FleetStore { place: place(into)? })
    }

    /// The identity of the results; `None` if there are none yet.
    ///
    /// # Errors
    ///
    /// The file exists but cannot be read.
    pub fn identity(&self) -> Result<Option<BuildIdentity>, JobError> {
        #[derive(serde::Deserialize)]
        struct Fleet {
            identity: BuildIdentity,
        }
        let Some(text) = self.place.read(FLEET)? else { return Ok(None) };
        let shown = self.place.shown(FLEET);
        let fleet: serde_json::Result<Fleet> = serde_json::from_str(&text);
        fleet
            .map(|fleet| Some(fleet.identity))
            .map_err(|error| JobError::Store { path: shown, reason: error.to_string() })
    }

    /// Location of a result.
    pub fn path(&self, name: &str, state: PieceState) -> PathBuf {
        self.place.shown(&key(name, state))
    }

    /// Whether a piece has a result. A piece that failed before and is done now counts as done.
    ///
    /// # Errors
    ///
    /// The store cannot be read. The same applies to the methods that follow.
    pub fn state(&self, name: &str) -> Result<Option<PieceState>, JobError> {
        for state in [PieceState::Done, PieceState::Failed] {
            if self.has_whole(&key(name, state))? {
                return Ok(Some(state));
            }
        }
        Ok(None)
    }

    /// Whether a key has a complete document.
    fn has_whole(&self, key: &str) -> Result<bool, JobError> {
        if !self.place.may_cut_off() {
            return self.place.has(key);
        }
        Ok(self.place.read(key)?.is_some_and(|text| is_whole(&text)))
    }

    /// The text of a result.
    ///
    /// # Errors
    ///
    /// Those of [`FleetStore::state`].
    pub fn read(&self, name: &str) -> Result<Option<(PieceState, String)>, JobError> {
        for state in [PieceState::Done, PieceState::Failed] {
            let text = self.place.read(&key(name, state))?;
            let counts = |text: &String| !self.place.may_cut_off() || is_whole(text);
            if let Some(text) = text.filter(counts) {
                return Ok(Some((state, text)));
            }
        }
        Ok(None)
    }

    /// Stores a result. An existing one stays, because it is the same.
    ///
    /// # Errors
    ///
    /// The store refused.
    pub fn put(&self, name: &str, state: PieceState, text: &str) -> Result<(), JobError> {
        match state {
            PieceState::Failed => self.place.put(&key(name, state), text),
            PieceState::Done => {
                self.place.put_same(&key(name, state), text)?;
                // An earlier failure.
                let _ = self.place.remove(&key(name, PieceState::Failed));
                Ok(())
            }
        }
    }

    /// The states of all pieces with a result.
    ///
    /// # Errors
    ///
    /// Those of [`FleetStore::state`].
    pub fn all(&self) -> Result<BTreeMap<String, PieceState>, JobError> {
        let mut states = BTreeMap::new();
        for state in [PieceState::Failed, PieceState::Done] {
            for key in self.place.keys(&format!("{}/", state.name()))? {
                let name = key.rsplit('/').next().and_then(|name| name.strip_suffix(".json"));
                let Some(name) = name.filter(|name| !name.starts_with('.')) else { continue };
                if self.has_whole(&key)? {
                    states.insert(name.to_owned(), state);
                }
            }
        }
        Ok(states)
    }

    /// Removes incomplete files of terminated processes.
    pub fn tidy(&self) {
        self.place.tidy();
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn found<T>(read: Result<T, JobError>) -> T {
        read.expect("the store is readable")
    }

    fn identity(build: &str) -> BuildIdentity {
        let text = |text: &str| text.to_owned();
        BuildIdentity {
            version: text("1"),
            build: text(build),
            platform: text("p"),
            arithmetic: text("a"),
        }
    }

    #[test]
    fn results_are_found_by_name_and_done_counts_before_failed() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("deep").join("results");
        let store = FleetStore::open(&path, &identity("b")).expect("it is made");
        let (one, two) = ("00112233445566778899aabbccddeeff", "ff112233445566778899aabbccddeeff");
        assert_eq!((found(store.state(one)), found(store.read(one))), (None, None));
        store.put(one, PieceState::Failed, "\"no\"\n").expect("writable");
        store.put(two, PieceState::Done, "\"yes\"\n").expect("writable");
        let states = BTreeMap::from([
            (one.to_owned(), PieceState::Failed),
            (two.to_owned(), PieceState::Done),
        ]);
        assert_eq!(found(store.all()), states);
        store.put(one, PieceState::Done, "\"after all\"\n").expect("writable");
        assert_eq!(found(store.read(one)), Some((PieceState::Done, "\"after all\"\n".to_owned())));
        assert!(!store.path(one, PieceState::Failed).exists());
        // A temporary file is not a result.
        let torn =
            store.path(two, PieceState::Done).with_file_name(format!(".{two}.json.host-1-0.tmp"));
        fs::write(&torn, "y").expect("writable");
        assert_eq!(found(store.all()).len(), 2);
        store.tidy();
        assert!(!torn.exists());
    }

    #[test]
    fn what_is_cut_off_is_no_result_wherever_it_is_cut() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let store = FleetStore::open(folder.path(), &identity("b")).expect("it is made");
        let name = "00112233445566778899aabbccddeeff";
        let text = json_text(&json!({ "state": "done", "result": { "a": [1, 2], "b": "}" } }));
        for state in [PieceState::Done, PieceState::Failed] {
            store.put(name, state, &text).expect("writable");
            assert_eq!(found(store.state(name)), Some(state));
            let document = text.trim_end();
            for end in 0..document.len() {
                fs::write(store.path(name, state), &document[..end]).expect("writable");
                assert_eq!(
                    (found(store.state(name)), found(store.read(name))),
                    (None, None),
                    "{end}"
                );
                assert_eq!(found(store.all()), BTreeMap::new(), "{end}");
            }
        }
        store.put(name, PieceState::Failed, &text).expect("writable");
        assert_eq!(
            found(store.read(name)),
            Some((PieceState::Failed, text.clone())),
            "done is cut off"
        );
        store.put(name, PieceState::Done, &text).expect("writable");
        assert_eq!(found(store.read(name)), Some((PieceState::Done, text)), "it is replaced");
    }

    #[test]
    fn a_place_that_this_program_does_not_know_is_refused_and_makes_no_folder() {
        let into = Path::new("s3://wells/results");
        let refused = FleetStore::open(into, &identity("b")).expect_err("it is built elsewhere");
        let refused = refused.to_string();
        assert!(
            refused.contains("`s3://wells/results`") && refused.contains("`tools/s3/`"),
            "{refused}"
        );
        assert!(is_elsewhere(into) && !Path::new("s3:").exists());
    }

    #[test]
    fn results_of_another_build_are_not_mixed_with() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        FleetStore::open(folder.path(), &identity("one")).expect("it is made");
        FleetStore::open(folder.path(), &identity("one")).expect("it is the same");
        let refused = FleetStore::open(folder.path(), &identity("two")).expect_err("it is another");
        let refused = refused.to_string();
        assert!(refused.contains("another build") && refused.contains("`into`"), "{refused}");
        let there = FleetStore::open_in(folder.path())
            .and_then(|store| store.identity())
            .expect("it is read");
        assert_eq!(there, Some(identity("one")), "which anybody may look at");
    }
}
