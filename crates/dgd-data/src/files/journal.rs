//! The journal of a long run: a file of finished results, from which the run can be resumed.
//!
//! ```text
//!   "dgd journal 1\n"  owner: 16 bytes                         identifies the run
//!   { length: 8  key: 16  result: length  check: 16 } …       check: digest of the three before it
//! ```
//!
//! Records are appended one at a time. A killed run leaves the last one incomplete, which its check shows; it is cut
//! off before anything is appended. Numbers are little-endian.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use dgd_identify::journal::{Digest, Journal};

const HEADER: &[u8] = b"dgd journal 1\n";

/// The journal of one run. It is removed when dropped, unless it is left for another: a run that has ended does not
/// need it.
#[derive(Debug)]
pub struct RunJournal {
    path: PathBuf,
    /// `None` after a failed write: later records could not be read.
    file: Mutex<Option<File>>,
    found: BTreeMap<u128, Vec<u8>>,
    is_left: AtomicBool,
}

/// The state of the journal before it was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorJournal {
    /// There is no journal, or it was not requested.
    Nothing,
    /// It has this many results of an identical run.
    Results(usize),
    /// It is of a run with other input, or of another program; it is replaced.
    Other,
}

/// Why there is no journal.
#[derive(Debug)]
pub enum JournalError {
    /// Another run is using it.
    InUse,
    /// The system refused.
    Failed(io::Error),
}

/// Treatment of an existing journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JournalOpening {
    /// It is resumed.
    Resume,
    /// It is replaced.
    Anew,
}

impl RunJournal {
    /// The journal of results that go to `out`: a hidden file beside it.
    pub fn path(out: &Path) -> PathBuf {
        let place = fs::canonicalize(out).unwrap_or_else(|_| out.to_owned());
        let mut name = OsString::from(".");
        name.push(place.file_name().unwrap_or_default());
        name.push(".dgd-journal");
        place.with_file_name(name)
    }

    /// Opens the journal of the run identified by `owner`.
    ///
    /// # Errors
    ///
    /// [`JournalError`]: another run is using it, or the system refused.
    pub fn open(
        path: PathBuf,
        owner: Digest,
        opening: JournalOpening,
    ) -> Result<(RunJournal, PriorJournal), JournalError> {
        let failed = JournalError::Failed;
        // A file that is not a journal must not be replaced.
        if let Ok(there) = fs::symlink_metadata(&path) {
            let is_journal = || -> io::Result<bool> {
                let mut begin = Vec::new();
                File::open(&path)?.take(HEADER.len() as u64).read_to_end(&mut begin)?;
                let name = &HEADER[..HEADER.len() - 2];
                Ok(begin.starts_with(name) || HEADER.starts_with(&begin))
            };
            if !there.is_file() || !is_journal().map_err(failed)? {
                return Err(failed(io::Error::other("there is another file of this name")));
            }
        }
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(&path).map_err(failed)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse),
            // File systems without locks are accepted.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        let header = [HEADER, &owner.value().to_le_bytes()].concat();
        let mut bytes = Vec::new();
        if opening == JournalOpening::Resume {
            file.read_to_end(&mut bytes).map_err(failed)?;
        }
        let (found, length, before) = match bytes.strip_prefix(header.as_slice()) {
            Some(records) => {
                let (found, length) = read(records);
                let count = found.len();
                (found, header.len() + length, PriorJournal::Results(count))
            }
            // A run that was killed immediately leaves part of a header.
            None if header.starts_with(&bytes) => (BTreeMap::new(), 0, PriorJournal::Nothing),
            None => (BTreeMap::new(), 0, PriorJournal::Other),
        };
        file.set_len(length as u64).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        if length == 0 {
            file.write_all(&header).map_err(failed)?;
        }
        let (file, is_left) = (Mutex::new(Some(file)), AtomicBool::new(false));
        Ok((RunJournal { path, file, found, is_left }, before))
    }

    /// Leaves it for a run that resumes.
    pub fn leave(&self) {
        self.is_left.store(true, Ordering::Relaxed);
    }
}

impl Journal for RunJournal {
    fn find(&self, key: u128) -> Option<Vec<u8>> {
        self.found.get(&key).cloned()
    }

    fn keep(&self, key: u128, result: &[u8]) {
        let record = record(key, result);
        // A journal that cannot be written does not end a run.
        if let Ok(mut place) = self.file.lock()
            && let Some(file) = place.as_mut()
            && file.write_all(&record).is_err()
        {
            *place = None;
        }
    }
}

impl Drop for RunJournal {
    fn drop(&mut self) {
        // Results from before a panic are kept.
        if !self.is_left.load(Ordering::Relaxed) && !std::thread::panicking() {
            // A leftover that cannot be removed is hidden, and the next run replaces it.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn record(key: u128, result: &[u8]) -> Vec<u8> {
    let mut record = Vec::with_capacity(result.len() + 40);
    record.extend((result.len() as u64).to_le_bytes());
    record.extend(key.to_le_bytes());
    record.extend(result);
    let check = Digest::EMPTY.bytes(&record).value();
    record.extend(check.to_le_bytes());
    record
}

/// The complete records up to the first incomplete one, and their length.
fn read(bytes: &[u8]) -> (BTreeMap<u128, Vec<u8>>, usize) {
    let (mut found, mut rest) = (BTreeMap::new(), bytes);
    while let Some((key, result, behind)) = first(rest) {
        found.insert(key, result.to_vec());
        rest = behind;
    }
    (found, bytes.len() - rest.len())
}

/// Key and result of the first record, and the rest; `None` if it is incomplete.
fn first(bytes: &[u8]) -> Option<(u128, &[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (key, rest) = rest.split_first_chunk()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (result, rest) = rest.split_at_checked(length)?;
    let (check, rest) = rest.split_first_chunk()?;
    let checked = &bytes[..bytes.len() - rest.len() - check.len()];
    let is_whole = Digest::EMPTY.bytes(checked).value() == u128::from_le_bytes(*check);
    is_whole.then_some((u128::from_le_bytes(*key), result, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OWNER: Digest = Digest::EMPTY;

    fn open(path: &Path, owner: Digest, opening: JournalOpening) -> (RunJournal, PriorJournal) {
        RunJournal::open(path.to_owned(), owner, opening).expect("the folder is writable")
    }

    /// Leaves the file like a killed run.
    #[allow(clippy::needless_pass_by_value, reason = "it is gone")]
    fn kill(journal: RunJournal) {
        journal.leave();
    }

    #[test]
    fn a_journal_that_is_torn_anywhere_gives_the_records_before() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = RunJournal::path(&folder.path().join("found"));
        let (journal, before) = open(&path, OWNER, JournalOpening::Resume);
        assert_eq!(before, PriorJournal::Nothing);
        let results: [&[u8]; 3] = [b"one", b"", &[7; 300]];
        let mut ends = vec![fs::metadata(&path).expect("it is there").len() as usize];
        for (key, result) in results.iter().enumerate() {
            journal.keep(key as u128, result);
            ends.push(fs::metadata(&path).expect("it is there").len() as usize);
        }
        kill(journal);
        let whole = fs::read(&path).expect("it was left");
        assert_eq!(whole.len(), ends[3]);
        for length in 0..=whole.len() {
            fs::write(&path, &whole[..length]).expect("the folder is writable");
            let (journal, before) = open(&path, OWNER, JournalOpening::Resume);
            let count = ends[1..].iter().filter(|end| **end <= length).count();
            let expected =
                if length < ends[0] { PriorJournal::Nothing } else { PriorJournal::Results(count) };
            assert_eq!(before, expected, "of {length} bytes");
            for (key, result) in results.iter().enumerate() {
                let stored = journal.find(key as u128);
                assert_eq!(stored.as_deref(), (key < count).then_some(*result));
            }
            // New records follow the last complete one.
            journal.keep(9, b"new");
            kill(journal);
            let (journal, before) = open(&path, OWNER, JournalOpening::Resume);
            assert_eq!(before, PriorJournal::Results(count + 1), "of {length} bytes");
            assert_eq!(journal.find(9).as_deref(), Some(b"new".as_slice()));
            drop(journal);
            assert!(!path.exists(), "a run that ends needs it no more");
        }
    }

    #[test]
    fn a_byte_that_has_changed_ends_what_is_believed() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("journal");
        let (journal, _) = open(&path, OWNER, JournalOpening::Anew);
        journal.keep(1, b"one");
        journal.keep(2, b"two");
        kill(journal);
        let mut bytes = fs::read(&path).expect("it was left");
        let place = bytes.len() - 17;
        bytes[place] ^= 1;
        fs::write(&path, &bytes).expect("the folder is writable");
        let (journal, before) = open(&path, OWNER, JournalOpening::Resume);
        assert_eq!((before, journal.find(2)), (PriorJournal::Results(1), None));
    }

    #[test]
    fn another_file_of_its_name_is_kept() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("journal");
        fs::write(&path, b"precious").expect("the folder is writable");
        for opening in [JournalOpening::Anew, JournalOpening::Resume] {
            let refused = RunJournal::open(path.clone(), OWNER, opening);
            assert!(matches!(refused, Err(JournalError::Failed(_))), "{refused:?}");
        }
        assert_eq!(fs::read(&path).expect("it is there"), b"precious");
        // The journal of another version counts as one.
        fs::write(&path, b"dgd journal 9\n").expect("the folder is writable");
        assert_eq!(open(&path, OWNER, JournalOpening::Resume).1, PriorJournal::Other);
    }

    #[test]
    fn the_journal_of_another_run_is_not_used() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("journal");
        let (journal, _) = open(&path, OWNER, JournalOpening::Anew);
        journal.keep(1, b"one");
        let in_use = RunJournal::open(path.clone(), OWNER, JournalOpening::Resume);
        assert!(matches!(in_use, Err(JournalError::InUse)), "{in_use:?}");
        kill(journal);
        let (journal, before) = open(&path, OWNER.debug(&"other"), JournalOpening::Resume);
        assert_eq!((before, journal.find(1)), (PriorJournal::Other, None));
        kill(journal);
        // It was replaced; without `Resume`, an existing journal is ignored.
        let (journal, before) = open(&path, OWNER, JournalOpening::Resume);
        assert_eq!(before, PriorJournal::Other);
        journal.keep(1, b"one");
        kill(journal);
        let (journal, before) = open(&path, OWNER, JournalOpening::Anew);
        assert_eq!((before, journal.find(1)), (PriorJournal::Nothing, None));
    }
}
