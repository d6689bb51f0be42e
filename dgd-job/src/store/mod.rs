//! Where results lie: a folder, or whatever else any number of processes and machines share.
//!
//! ```text
//!   DIR/fleet.json           the build and the type of machine whose results these are, written once
//!   DIR/done/ab/abcd….json   the result of the piece of this name
//!   DIR/failed/ab/abcd….json why it has none
//! ```
//!
//! A file is there whole or not at all, and says by being there that the piece is done. So it is asked for, and nobody
//! has to be told. One that is cut off all the same, by a disk that was full or a copy that ended early, is no result:
//! the piece is open, and done again.

mod folder;

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use dgd_work::json_text;
use serde_json::json;

use crate::identity::Identity;
use crate::job::JobError;
use folder::Folder;

/// What holds texts by keys, as `done/ab/abcd….json`: each is there whole or not at all.
pub trait Place: Debug + Send + Sync {
    /// Whether a text may be there in part, so that it has to be read to know. Not where the place itself keeps texts whole.
    fn may_cut_off(&self) -> bool {
        false
    }

    /// The text of a key; nothing where there is none.
    ///
    /// # Errors
    ///
    /// It cannot be said whether there is one. The same of all others.
    fn read(&self, key: &str) -> Result<Option<String>, JobError>;

    /// Whether there is a text.
    fn has(&self, key: &str) -> Result<bool, JobError>;

    /// Puts a text where there is none. Of several that do so one has its way, and the others go on as if they had.
    fn put_first(&self, key: &str, text: &str) -> Result<(), JobError>;

    /// Puts a text that can only be the one that is there, where there is one.
    fn put_same(&self, key: &str, text: &str) -> Result<(), JobError> {
        self.put_first(key, text)
    }

    /// Puts a text, in place of one that is there.
    fn put(&self, key: &str, text: &str) -> Result<(), JobError>;

    /// Removes a text, where there is one.
    fn remove(&self, key: &str) -> Result<(), JobError>;

    /// All keys that begin so, in no order.
    fn keys(&self, begin: &str) -> Result<Vec<String>, JobError>;

    /// Removes what processes left half written that were ended.
    fn tidy(&self) {}

    /// Where a key is found, for people.
    fn shown(&self, key: &str) -> PathBuf;
}

/// Opens a place other than a folder, by what its name begins with.
pub type Opens = fn(&str) -> Result<Arc<dyn Place>, JobError>;

/// What names of other places begin with.
const ELSEWHERE: &str = "s3://";

static OPENS: OnceLock<Opens> = OnceLock::new();

/// Has this program open places that `s3://` names.
pub fn set_opens(opens: Opens) {
    let _ = OPENS.set(opens);
}

/// Whether results lie in no folder of this machine.
pub fn is_elsewhere(into: &Path) -> bool {
    into.to_str().is_some_and(|name| name.starts_with(ELSEWHERE))
}

fn place(into: &Path) -> Result<Arc<dyn Place>, JobError> {
    let Some(name) = into.to_str().filter(|_| is_elsewhere(into)) else {
        return Ok(Arc::new(Folder { folder: into.to_owned() }));
    };
    match OPENS.get() {
        Some(opens) => opens(name),
        None => Err(JobError(format!(
            "`{name}`: this build writes results to folders only; the program that is built in `s3/` of the sources also \
             writes to buckets"
        ))),
    }
}

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
#[derive(Debug, Clone)]
pub struct Store {
    place: Arc<dyn Place>,
}

/// The file that says whose results these are.
const FLEET: &str = "fleet.json";

/// First hexadecimal digits of a name that name the folder of the result: a folder has few enough files then.
const SHARD: usize = 2;

/// The key of a result.
fn key(name: &str, state: State) -> String {
    let shard = name.get(..SHARD).unwrap_or(name);
    format!("{}/{shard}/{name}.json", state.name())
}

/// Whether a text is a document to its end.
fn is_whole(text: &str) -> bool {
    serde_json::from_str::<serde::de::IgnoredAny>(text).is_ok()
}

impl Store {
    /// Opens the results of this build, and makes the folder where there is none.
    ///
    /// # Errors
    ///
    /// The results there are of another build or another type of machine; or the system refused.
    pub fn open(into: &Path, identity: &Identity) -> Result<Store, JobError> {
        let store = Store::at(into)?;
        if !store.place.has(FLEET)? {
            let text = json_text(&json!({ "fleet": 1, "identity": identity }));
            store.place.put_first(FLEET, &text)?;
        }
        let there = store.identity()?;
        match there.as_ref().and_then(|there| identity.difference(there)) {
            None => Ok(store),
            Some(difference) => Err(JobError(format!(
                "this is {difference}, of which the results in `{}` are: give another folder to `--into`, or do the \
                 rest with that build",
                into.display()
            ))),
        }
    }

    /// Looks at results that are there, of whatever build.
    ///
    /// # Errors
    ///
    /// There is no such place.
    pub fn at(into: &Path) -> Result<Store, JobError> {
        Ok(Store { place: place(into)? })
    }

    /// Whose results they are; nothing where there are none yet.
    ///
    /// # Errors
    ///
    /// The file is there and cannot be read.
    pub fn identity(&self) -> Result<Option<Identity>, JobError> {
        let Some(text) = self.place.read(FLEET)? else { return Ok(None) };
        let read = || -> serde_json::Result<Identity> {
            let value: serde_json::Value = serde_json::from_str(&text)?;
            serde_json::from_value(value["identity"].clone())
        };
        let shown = self.place.shown(FLEET);
        read().map(Some).map_err(|error| JobError(format!("`{}`: {error}", shown.display())))
    }

    /// Where a result is found.
    pub fn path(&self, name: &str, state: State) -> PathBuf {
        self.place.shown(&key(name, state))
    }

    /// Whether a piece has a result. One that failed before and is done now is done.
    ///
    /// # Errors
    ///
    /// It cannot be said. The same of all that follow.
    pub fn state(&self, name: &str) -> Result<Option<State>, JobError> {
        for state in [State::Done, State::Failed] {
            if self.has_whole(&key(name, state))? {
                return Ok(Some(state));
            }
        }
        Ok(None)
    }

    /// Whether there is a text, and that is a document to its end.
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
    /// As of [`Store::state`].
    pub fn read(&self, name: &str) -> Result<Option<(State, String)>, JobError> {
        for state in [State::Done, State::Failed] {
            let text = self.place.read(&key(name, state))?;
            let counts = |text: &String| !self.place.may_cut_off() || is_whole(text);
            if let Some(text) = text.filter(counts) {
                return Ok(Some((state, text)));
            }
        }
        Ok(None)
    }

    /// Puts a result there, whole or not at all. One that is there already stays: it is the same.
    ///
    /// # Errors
    ///
    /// The place refused.
    pub fn put(&self, name: &str, state: State, text: &str) -> Result<(), JobError> {
        match state {
            State::Failed => self.place.put(&key(name, state), text),
            State::Done => {
                self.place.put_same(&key(name, state), text)?;
                // What it failed with before.
                let _ = self.place.remove(&key(name, State::Failed));
                Ok(())
            }
        }
    }

    /// All pieces that have a result.
    ///
    /// # Errors
    ///
    /// As of [`Store::state`].
    pub fn all(&self) -> Result<BTreeMap<String, State>, JobError> {
        let mut all = BTreeMap::new();
        for state in [State::Failed, State::Done] {
            for key in self.place.keys(&format!("{}/", state.name()))? {
                let name = key.rsplit('/').next().and_then(|name| name.strip_suffix(".json"));
                let Some(name) = name.filter(|name| !name.starts_with('.')) else { continue };
                if self.has_whole(&key)? {
                    all.insert(name.to_owned(), state);
                }
            }
        }
        Ok(all)
    }

    /// Removes what processes left half written that were ended, where the piece has a result by now.
    pub fn tidy(&self) {
        self.place.tidy();
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

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
        assert_eq!((store.state(one), store.read(one)), (Ok(None), Ok(None)));
        store.put(one, State::Failed, "\"no\"\n").expect("writable");
        store.put(two, State::Done, "\"yes\"\n").expect("writable");
        let states =
            BTreeMap::from([(one.to_owned(), State::Failed), (two.to_owned(), State::Done)]);
        assert_eq!(store.all(), Ok(states));
        store.put(one, State::Done, "\"after all\"\n").expect("writable");
        assert_eq!(store.read(one), Ok(Some((State::Done, "\"after all\"\n".to_owned()))));
        assert!(!store.path(one, State::Failed).exists());
        // A draft is not a result.
        let torn = store.path(two, State::Done).with_file_name(format!(".{two}.json.host-1-0.tmp"));
        fs::write(&torn, "y").expect("writable");
        assert_eq!(store.all().map(|all| all.len()), Ok(2));
        store.tidy();
        assert!(!torn.exists());
    }

    #[test]
    fn what_is_cut_off_is_no_result_wherever_it_is_cut() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let store = Store::open(folder.path(), &identity("b")).expect("it is made");
        let name = "00112233445566778899aabbccddeeff";
        let text = json_text(&json!({ "state": "done", "result": { "a": [1, 2], "b": "}" } }));
        for state in [State::Done, State::Failed] {
            store.put(name, state, &text).expect("writable");
            assert_eq!(store.state(name), Ok(Some(state)));
            let document = text.trim_end();
            for end in 0..document.len() {
                fs::write(store.path(name, state), &document[..end]).expect("writable");
                assert_eq!((store.state(name), store.read(name)), (Ok(None), Ok(None)), "{end}");
                assert_eq!(store.all(), Ok(BTreeMap::new()), "{end}");
            }
        }
        store.put(name, State::Failed, &text).expect("writable");
        assert_eq!(store.read(name), Ok(Some((State::Failed, text.clone()))), "done is cut off");
        store.put(name, State::Done, &text).expect("writable");
        assert_eq!(store.read(name), Ok(Some((State::Done, text))), "it is replaced");
    }

    #[test]
    fn a_place_that_this_program_does_not_know_is_refused_and_makes_no_folder() {
        let into = Path::new("s3://wells/results");
        let refused = Store::open(into, &identity("b")).expect_err("it is built elsewhere");
        assert!(
            refused.0.contains("`s3://wells/results`") && refused.0.contains("`s3/`"),
            "{refused}"
        );
        assert!(is_elsewhere(into) && !Path::new("s3:").exists());
    }

    #[test]
    fn results_of_another_build_are_not_mixed_with() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        Store::open(folder.path(), &identity("one")).expect("it is made");
        Store::open(folder.path(), &identity("one")).expect("it is the same");
        let refused = Store::open(folder.path(), &identity("two")).expect_err("it is another");
        assert!(refused.0.contains("another build") && refused.0.contains("--into"), "{refused}");
        let there =
            Store::at(folder.path()).and_then(|store| store.identity()).expect("it is read");
        assert_eq!(there, Some(identity("one")), "which anybody may look at");
    }
}
