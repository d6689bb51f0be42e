//! A test case: a model with its imports and a recording of its inputs.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;

use crate::facts::Fact;
use crate::prepared::EFFECT;

/// A test case for the oracles.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Text of the model.
    pub model: String,
    /// Texts of imported files, by path relative to the model.
    pub files: BTreeMap<String, String>,
    /// The recording, in the form of a CSV file; empty for a model without inputs.
    pub data: String,
    /// End of the run, s.
    pub until: f64,
    /// Known facts about the solution.
    pub facts: Vec<Fact>,
    /// Whether the order of items matters, because coinciding resets read each other.
    pub is_ordered: bool,
}

/// End of a run whose model file does not give it, s.
const DEFAULT_UNTIL: f64 = 2.0;
/// Prefix of the line that gives the end of the run.
const UNTIL: &str = "# until: ";
/// Marks a model whose items have an order.
const ORDERED: &str = "# in this order";

/// Number of rows of a run between its start and end.
const ROWS: u32 = 20;

impl Case {
    /// Reads `NAME.dgd`, `NAME.csv` beside it if it exists, and imported files.
    ///
    /// # Errors
    ///
    /// If the model cannot be read.
    pub fn read(path: &Path) -> io::Result<Case> {
        let model = fs::read_to_string(path)?;
        let data = fs::read_to_string(path.with_extension("csv")).unwrap_or_default();
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut files = BTreeMap::new();
        let mut unread = vec![model.clone()];
        while let Some(text) = unread.pop() {
            let imports = text.lines().filter_map(|line| line.trim().strip_prefix("import \""));
            for import in imports.filter_map(|rest| rest.split('"').next()) {
                if let Ok(text) = fs::read_to_string(folder.join(import))
                    && files.insert(import.to_owned(), text.clone()).is_none()
                {
                    unread.push(text);
                }
            }
        }
        if let Ok(text) = fs::read_to_string(folder.join(EFFECT)) {
            files.insert(EFFECT.to_owned(), text);
        }
        let facts = model.lines().filter_map(Fact::read).collect();
        let is_ordered = model.lines().any(|line| line == ORDERED);
        let until = model.lines().find_map(|line| line.strip_prefix(UNTIL)?.parse().ok());
        let mut case = Case { model, files, data, until: DEFAULT_UNTIL, facts, is_ordered };
        let last = case.recording().0.last().copied();
        case.until = until.or(last).unwrap_or(case.until);
        Ok(case)
    }

    /// Writes the case in the form that [`Case::read`] reads.
    ///
    /// # Errors
    ///
    /// If a file cannot be written.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let folder = path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        fs::write(path, self.text())?;
        if !self.data.is_empty() {
            fs::write(path.with_extension("csv"), &self.data)?;
        }
        for (name, text) in &self.files {
            let file = folder.join(name);
            fs::create_dir_all(file.parent().unwrap_or(folder))?;
            fs::write(file, text)?;
        }
        Ok(())
    }

    /// The model, followed by comments with the other data that [`Case::read`] needs.
    pub fn text(&self) -> String {
        let mut text = self.model.clone();
        let last = self.recording().0.last().copied();
        let is_told = last.unwrap_or(DEFAULT_UNTIL) == self.until;
        if !is_told && !text.lines().any(|line| line.starts_with(UNTIL)) {
            let _ = writeln!(text, "{UNTIL}{}", self.until);
        }
        if self.is_ordered && !text.lines().any(|line| line == ORDERED) {
            let _ = writeln!(text, "{ORDERED}");
        }
        for fact in self.facts.iter().map(Fact::to_string) {
            if !text.lines().any(|line| line == fact) {
                let _ = writeln!(text, "{fact}");
            }
        }
        text
    }

    /// Sample times, s, and the columns by name, in the units of the header.
    pub(crate) fn recording(&self) -> (Vec<f64>, BTreeMap<String, Vec<f64>>) {
        let mut lines = self.data.lines();
        let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let names: Vec<String> = (header.iter())
            .map(|cell| cell.split_whitespace().next().unwrap_or_default().to_owned())
            .collect();
        let mut times = Vec::new();
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
        for line in lines {
            for (k, cell) in line.split(',').enumerate() {
                let value = cell.trim().parse().unwrap_or(f64::NAN);
                match columns.get_mut(k) {
                    Some(_) if k == 0 => times.push(value),
                    Some(column) => column.push(value),
                    None => {}
                }
            }
        }
        (times, names.into_iter().zip(columns).skip(1).collect())
    }

    /// Times of the rows of a run, evenly spaced such that none is a sample.
    pub(crate) fn times(&self) -> Vec<f64> {
        (0..=ROWS).map(|k| self.until * (f64::from(k) / f64::from(ROWS))).collect()
    }
}
