//! Jobs: wells, their recordings, and the tasks for each.
//!
//! ```json
//! {
//!   "model": "pump.dgd",
//!   "options": ["--start", "measured"],
//!   "do": ["fit", { "kind": "starts", "count": 20 }, { "kind": "profile", "of": ["c0"] }, "discover"],
//!   "wells": {
//!     "A-1": "a1.csv",
//!     "A-2": [
//!       { "when": "2024-03", "data": "a2/march.csv", "valid": "a2/april.csv" },
//!       { "when": "2025-03", "data": ["a2/one.csv", "a2/two.csv"] }
//!     ],
//!     "A-3": { "options": ["--set", "depth=2100"], "recordings": ["a3.csv"] }
//!   }
//! }
//! ```
//!
//! Pieces are numbered in the order of the file: by well, within a well by occasion.

mod error;
mod read;
mod unique;

use std::path::{Path, PathBuf};

use crate::piece::{Piece, PieceKind};
use crate::syntax::OptionSyntax;

pub use error::{ExpectedValue, JobError, JobMistake};
pub use read::bytes;

/// A job.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// The folder of the job file, to which all paths are relative.
    pub folder: PathBuf,
    /// The model file.
    pub model: String,
    /// Options of all commands.
    pub options: Vec<String>,
    /// Seed of everything random.
    pub seed: u64,
    /// Threads for a piece.
    pub threads: usize,
    /// Memory limit of a piece, bytes.
    pub memory: Option<u64>,
    /// Tasks for each occasion.
    pub todo: Vec<PeriodTask>,
    /// The wells.
    pub wells: Vec<Asset>,
    /// Number of the first piece of each well, and the total number of pieces.
    begins: Vec<usize>,
}

/// A task for each occasion.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PeriodTask {
    /// Its pieces.
    pub kinds: Vec<PieceKind>,
    /// Additional options.
    pub options: Vec<String>,
}

/// A well.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Asset {
    /// Its name.
    pub name: String,
    /// Its model, if not the common one.
    pub model: Option<String>,
    /// Additional options.
    pub options: Vec<String>,
    /// Its occasions, in order of time.
    pub occasions: Vec<Period>,
}

/// Recordings that are used together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Period {
    /// Their date as given in the file, or the name of the first recording.
    pub when: String,
    /// Training recordings.
    pub data: Vec<String>,
    /// Recordings for validation.
    pub valid: Vec<String>,
    /// Additional options.
    pub options: Vec<String>,
}

impl Job {
    /// Reads a job file.
    ///
    /// # Errors
    ///
    /// It cannot be read, or is invalid.
    pub fn load(path: &Path, syntax: OptionSyntax) -> Result<Job, JobError> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| JobError::Unreadable { path: path.to_owned(), error })?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Job::read(&text, folder.unwrap_or(Path::new(".")), syntax).map_err(|mistake| {
            JobError::Invalid { path: path.to_owned(), mistake: Box::new(mistake) }
        })
    }

    /// Reads the text of a job file in this folder.
    ///
    /// # Errors
    ///
    /// A mistake, with its place.
    pub fn read(text: &str, folder: &Path, syntax: OptionSyntax) -> Result<Job, JobMistake> {
        let mut job = read::job(text, folder, syntax)?;
        let each = job.each();
        let mut next = 0;
        job.begins.push(next);
        for well in &job.wells {
            next += each * well.occasions.len();
            job.begins.push(next);
        }
        Ok(job)
    }

    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.begins.last().copied().unwrap_or_default()
    }

    /// Whether there are no pieces.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of pieces of an occasion.
    fn each(&self) -> usize {
        self.todo.iter().map(|one| one.kinds.len()).sum()
    }

    /// The number of the first piece of an occasion of a well.
    pub fn first(&self, well: usize, occasion: usize) -> usize {
        self.begins[well] + occasion * self.each()
    }

    /// A piece by its number, from 0.
    pub fn piece(&self, index: usize) -> Option<Piece> {
        if index >= self.len() {
            return None;
        }
        let place = self.begins.partition_point(|begin| *begin <= index) - 1;
        let well = &self.wells[place];
        let rest = index - self.begins[place];
        let occasion = &well.occasions[rest / self.each()];
        let mut rest = rest % self.each();
        let todo = self.todo.iter().find(|one| {
            let is_it = rest < one.kinds.len();
            if !is_it {
                rest -= one.kinds.len();
            }
            is_it
        })?;
        let options = [&self.options, &well.options, &occasion.options, &todo.options];
        Some(Piece {
            well: well.name.clone(),
            when: occasion.when.clone(),
            kind: todo.kinds[rest].clone(),
            model: well.model.clone().unwrap_or_else(|| self.model.clone()),
            data: occasion.data.clone(),
            valid: occasion.valid.clone(),
            options: options.into_iter().flatten().cloned().collect(),
            seed: self.seed,
        })
    }

    /// All pieces, in order.
    pub fn pieces(&self) -> impl Iterator<Item = Piece> {
        (0..self.len()).filter_map(|index| self.piece(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::tests::PLUS;

    fn read(text: &str) -> Result<Job, JobMistake> {
        Job::read(text, Path::new("there"), PLUS)
    }

    const JOB: &str = r#"{
        "model": "m.dgd", "options": ["+rtol", "1e-7"], "seed": 5, "threads": 2, "memory": "1.5 GB",
        "do": ["fit", { "kind": "starts", "count": 3, "options": ["+loss", "huber"] },
               { "kind": "replicates", "count": 25, "each": 10 }, { "kind": "profile", "of": ["a", "b"] }, "discover"],
        "wells": {
            "one": "one.csv",
            "two": [{ "when": "2024", "data": ["a.csv", "b.csv"], "valid": "c.csv" }, "d/e.csv"],
            "three": { "model": "n.dgd", "options": ["+set", "c=1"],
                       "recordings": [{ "data": "f.csv", "options": ["+until", "9"] }] }
        }
    }"#;

    #[test]
    fn pieces_are_counted_through_wells_occasions_and_what_is_done() {
        let job = read(JOB).expect("a job");
        assert_eq!((job.threads, job.memory, job.len()), (2, Some(1_500_000_000), 4 * 10));
        let texts: Vec<String> =
            job.pieces().map(|p| format!("{} {} {}", p.well, p.when, p.kind)).collect();
        assert_eq!(texts[0], "one one fit");
        assert_eq!(texts[10], "two 2024 fit");
        assert_eq!(texts[13], "two 2024 start 2 of 3");
        assert_eq!(texts[14], "two 2024 replicates 0 to 9");
        assert_eq!(texts[16], "two 2024 replicates 20 to 24");
        assert_eq!(texts[18], "two 2024 profile of `b`");
        assert_eq!(texts[29], "two e discover");
        assert_eq!(texts[39], "three f discover");
        let command = |index: usize| job.piece(index).expect("a piece").command(PLUS);
        assert_eq!(command(0), "dgd fit m.dgd +data one.csv +rtol 1e-7 +seed 5");
        assert_eq!(
            command(11),
            "dgd fit m.dgd +data a.csv +data b.csv +valid c.csv +rtol 1e-7 +loss huber +starts 3 \
             +start-point 0 +seed 5"
        );
        assert_eq!(
            command(39),
            "dgd discover n.dgd +data f.csv +rtol 1e-7 +set c=1 +until 9 +seed 5"
        );
        assert_eq!((job.first(1, 1), job.first(2, 0)), (20, 30));
        assert_eq!(job.piece(40), None);
    }

    #[test]
    fn what_makes_no_sense_is_named_with_its_place() {
        let wells = r#""wells": { "a": "a.csv" }"#;
        for (text, parts) in [
            ("{", vec!["line 1"]),
            (r#"{ "modle": "m.dgd" }"#, vec!["`modle`", "did you mean `model`?"]),
            (r#"{ "do": ["fit"], "wells": { "a": "a.csv" } }"#, vec!["no model", "`wells.a`"]),
            (r#"{ "model": "m", "wells": { "a": "a.csv" } }"#, vec!["`do`", "\"do\": [\"fit\"]"]),
            (r#"{ "model": "m", "do": ["fit"] }"#, vec!["`wells`"]),
            (r#"{ "model": "m", "do": ["fit"], "wells": {} }"#, vec!["`wells`"]),
            (r#"{ "model": "m", "do": ["fitt"], "wells": {"a": "b"} }"#, vec!["`do[0]`", "`fit`"]),
            (
                r#"{ "model": "m", "do": ["starts"], "wells": {"a": "b"} }"#,
                vec!["`do[0]`", r#"{ "kind": "starts", "count": 20 }"#],
            ),
            (
                r#"{ "model": "m", "do": [{"kind": "profile"}], "wells": {"a": "b"} }"#,
                vec!["`do[0]`", "`of`"],
            ),
            (
                r#"{ "model": "m", "do": ["fit"], "wells": { "a": [{ "dta": "x" }] } }"#,
                vec!["`wells.a[0].dta`", "`data`"],
            ),
            (
                r#"{ "model": "m", "do": ["fit"], "wells": { "a": [{ "when": "x" }] } }"#,
                vec!["`wells.a[0]`", "`data`"],
            ),
            (r#"{ "model": "m", "do": ["fit"], "wells": { "a": 3 } }"#, vec!["`wells.a`", "3"]),
            (
                r#"{ "model": "m", "do": ["fit"], "wells": { "a": ["x.csv", "y/x.csv"] } }"#,
                vec!["`wells.a`", "`x`", "when"],
            ),
            (
                "{ \"model\": \"m\",\n\"wells\": { \"a\": \"x\", \"a\": \"y\" } }",
                vec!["`a` twice", "line 2"],
            ),
            (
                &format!(r#"{{ "model": "m", "do": ["fit"], "memory": "much", {wells} }}"#),
                vec!["`memory`", "\"2 GB\""],
            ),
            (
                &format!(r#"{{ "model": "m", "do": ["fit"], "threads": 0, {wells} }}"#),
                vec!["`threads`"],
            ),
            (
                &format!(r#"{{ "model": "m", "do": ["fit"], "options": "+rtol 1", {wells} }}"#),
                vec!["`options`", "list"],
            ),
            (
                &format!(
                    r#"{{ "model": "m", "do": ["fit"], "options": ["+data", "x"], {wells} }}"#
                ),
                vec!["`options`", "`+data`", "`wells`"],
            ),
        ] {
            let mistake = read(text).expect_err(text);
            let message = mistake.sentence().spelled(PLUS.spelling);
            for part in parts {
                assert!(message.contains(part), "no {part} in {message}");
            }
        }
    }
}
