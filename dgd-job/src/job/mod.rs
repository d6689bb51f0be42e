//! What is to be done: wells, their recordings, and what is done with each.
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
//! Pieces are counted through: all of a well, of that all of an occasion, in the order of the file.

mod read;
mod unique;

use std::error::Error;
use std::fmt;
use std::path::{Path, PathBuf};

use crate::piece::{Kind, Piece};

pub use read::bytes;

/// A job.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// The folder that all its paths are seen from: that of its file.
    pub folder: PathBuf,
    /// The model file.
    pub model: String,
    /// Options of all commands.
    pub options: Vec<String>,
    /// Seed of everything random.
    pub seed: u64,
    /// Threads for a piece.
    pub threads: usize,
    /// Most memory for a piece, bytes.
    pub memory: Option<u64>,
    /// What is done at each occasion.
    pub todo: Vec<Do>,
    /// The wells.
    pub wells: Vec<Well>,
    /// Number of the first piece of each well, and of all behind them.
    begins: Vec<usize>,
}

/// Something that is done at each occasion.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Do {
    /// The pieces of it.
    pub kinds: Vec<Kind>,
    /// Options besides.
    pub options: Vec<String>,
}

/// A well.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Well {
    /// Its name.
    pub name: String,
    /// Its model, where it is not that of all.
    pub model: Option<String>,
    /// Options besides.
    pub options: Vec<String>,
    /// When it was recorded, in order of time.
    pub occasions: Vec<Occasion>,
}

/// Recordings that are used together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Occasion {
    /// When they were made, as the file says it, or else the name of the first.
    pub when: String,
    /// Recordings to fit to.
    pub data: Vec<String>,
    /// Recordings for validation.
    pub valid: Vec<String>,
    /// Options besides.
    pub options: Vec<String>,
}

/// What is wrong with a job file, as one sentence with the place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JobError(pub String);

impl fmt::Display for JobError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Error for JobError {}

impl Job {
    /// Reads a job file.
    ///
    /// # Errors
    ///
    /// It cannot be read, or says what makes no sense.
    pub fn load(path: &Path) -> Result<Job, JobError> {
        let said = |what: String| JobError(format!("`{}`: {what}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|error| said(error.to_string()))?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Job::read(&text, folder.unwrap_or(Path::new("."))).map_err(said)
    }

    /// Reads the text of a job file that lies in this folder.
    ///
    /// # Errors
    ///
    /// What makes no sense in it, with the place.
    pub fn read(text: &str, folder: &Path) -> Result<Job, String> {
        let mut job = read::job(text, folder)?;
        let each = job.each();
        let mut next = 0;
        job.begins.push(next);
        for well in &job.wells {
            next += each * well.occasions.len();
            job.begins.push(next);
        }
        Ok(job)
    }

    /// How many pieces it has.
    pub fn len(&self) -> usize {
        self.begins.last().copied().unwrap_or_default()
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The pieces of an occasion.
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

    fn read(text: &str) -> Result<Job, String> {
        Job::read(text, Path::new("there"))
    }

    const JOB: &str = r#"{
        "model": "m.dgd", "options": ["--rtol", "1e-7"], "seed": 5, "threads": 2, "memory": "1.5 GB",
        "do": ["fit", { "kind": "starts", "count": 3, "options": ["--loss", "huber"] },
               { "kind": "replicates", "count": 25, "each": 10 }, { "kind": "profile", "of": ["a", "b"] }, "discover"],
        "wells": {
            "one": "one.csv",
            "two": [{ "when": "2024", "data": ["a.csv", "b.csv"], "valid": "c.csv" }, "d/e.csv"],
            "three": { "model": "n.dgd", "options": ["--set", "c=1"],
                       "recordings": [{ "data": "f.csv", "options": ["--until", "9"] }] }
        }
    }"#;

    #[test]
    fn pieces_are_counted_through_wells_occasions_and_what_is_done() {
        let job = read(JOB).expect("a job");
        assert_eq!((job.threads, job.memory, job.len()), (2, Some(1_500_000_000), 4 * 10));
        let said: Vec<String> =
            job.pieces().map(|p| format!("{} {} {}", p.well, p.when, p.kind)).collect();
        assert_eq!(said[0], "one one fit");
        assert_eq!(said[10], "two 2024 fit");
        assert_eq!(said[13], "two 2024 start 2 of 3");
        assert_eq!(said[14], "two 2024 replicates 0 to 9");
        assert_eq!(said[16], "two 2024 replicates 20 to 24");
        assert_eq!(said[18], "two 2024 profile of `b`");
        assert_eq!(said[29], "two e discover");
        assert_eq!(said[39], "three f discover");
        let of = |index: usize| job.piece(index).expect("a piece").command();
        assert_eq!(of(0), "dgd fit m.dgd --data one.csv --rtol 1e-7 --seed 5");
        assert_eq!(
            of(11),
            "dgd fit m.dgd --data a.csv --data b.csv --valid c.csv --rtol 1e-7 --loss huber --starts 3 \
             --start-point 0 --seed 5"
        );
        assert_eq!(
            of(39),
            "dgd discover n.dgd --data f.csv --rtol 1e-7 --set c=1 --until 9 --seed 5"
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
                &format!(r#"{{ "model": "m", "do": ["fit"], "options": "--rtol 1", {wells} }}"#),
                vec!["`options`", "list"],
            ),
            (
                &format!(
                    r#"{{ "model": "m", "do": ["fit"], "options": ["--data", "x"], {wells} }}"#
                ),
                vec!["`options`", "`--data`", "`wells`"],
            ),
        ] {
            let said = read(text).expect_err(text);
            for part in parts {
                assert!(said.contains(part), "no {part} in {said}");
            }
        }
    }
}
