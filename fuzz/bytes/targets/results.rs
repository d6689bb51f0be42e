//! Arbitrary bytes after the header of a journal of results, from which a run resumes.
#![no_main]

use std::fs;

use dgd_data::files::journal::{JournalOpening, RunJournal};
use dgd_identify::journal::Digest;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = std::env::temp_dir().join(format!("dgd-fuzz-{}.journal", std::process::id()));
    // The header of a new journal.
    let _ = fs::remove_file(&path);
    if let Ok((journal, _)) = RunJournal::open(path.clone(), Digest::EMPTY, JournalOpening::Anew) {
        journal.leave();
    }
    let mut text = fs::read(&path).unwrap_or_default();
    match bytes.split_first() {
        // Sometimes with another header.
        Some((0, rest)) => text = rest.to_vec(),
        _ => text.extend(bytes),
    }
    if fs::write(&path, text).is_ok() {
        // An unrelated file of that name is kept.
        let Ok((journal, _)) =
            RunJournal::open(path.clone(), Digest::EMPTY, JournalOpening::Resume)
        else {
            return;
        };
        journal.leave();
        drop(journal);
        // A truncated record is dropped; the second time nothing is.
        let kept = fs::read(&path).unwrap_or_default();
        let again = RunJournal::open(path.clone(), Digest::EMPTY, JournalOpening::Resume)
            .expect("a journal");
        again.0.leave();
        drop(again);
        assert_eq!(fs::read(&path).unwrap_or_default(), kept);
    }
});
