//! A case as files.

use std::fmt::Write as _;
use std::path::Path;
use std::{fs, io};

use super::{Case, Recording, Truth};

impl Recording {
    /// The text of a file; what is not a number is an empty cell.
    pub(crate) fn csv(&self) -> String {
        let mut text = format!("time [{}]", self.time_unit);
        for column in &self.columns {
            let _ = write!(text, ",{} [{}]", column.name, column.unit);
        }
        text.push('\n');
        for (row, time) in self.times.iter().enumerate() {
            text.push_str(&short(*time));
            for column in &self.columns {
                text.push(',');
                text.push_str(&short(column.values[row]));
            }
            text.push('\n');
        }
        text
    }
}

/// A number to twelve digits, without what binary arithmetic adds behind them.
fn short(x: f64) -> String {
    if x.is_nan() {
        return String::new();
    }
    format!("{x:.11e}").parse().map_or_else(|_| x.to_string(), |x: f64| x.to_string())
}

impl Case {
    /// All files of the case but the truth, by their paths in its folder.
    pub(crate) fn files(&self) -> Vec<(String, String)> {
        let mut files = vec![("model.dgd".to_owned(), self.model.clone())];
        files.extend(
            self.effects.iter().map(|(name, text)| (format!("effects/{name}.dgd"), text.clone())),
        );
        files.push(("train.csv".to_owned(), self.train.csv()));
        files.push(("valid.csv".to_owned(), self.valid.csv()));
        files
    }

    /// Writes a folder with all files and the truth.
    pub(crate) fn write(&self, folder: &Path) -> io::Result<()> {
        let folder = folder.join(&self.name);
        fs::create_dir_all(&folder)?;
        for (path, text) in self.files() {
            let path = folder.join(path);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent)?;
            }
            fs::write(path, text)?;
        }
        fs::write(folder.join("truth.json"), self.truth_json())
    }

    /// What is hidden, for programs.
    pub(crate) fn truth_json(&self) -> String {
        let mut fields = vec![
            ("case", string(&self.name)),
            ("domain", string(self.domain)),
            ("kind", string(self.kind.word())),
            ("hidden", string(self.hidden)),
            ("noise", string(self.noise.word())),
        ];
        match self.truth {
            Truth::Nothing => fields.push(("effects", "[]".to_owned())),
            Truth::Library => fields.push(("effects", strings(self.hidden.split('+')))),
            Truth::Template(accepted) => {
                fields.push(("accepted", strings(accepted.iter().copied())));
            }
            Truth::Parameter { name, places, law } => {
                fields.push(("parameter", string(name)));
                fields.push(("places", strings(places.iter().copied())));
                fields.push(("law", string(law)));
                fields.push(("trace_train", numbers(&self.train.trace)));
                fields.push(("trace_valid", numbers(&self.valid.trace)));
            }
        }
        let sizes = self.train.sizes.iter();
        let sizes: Vec<String> =
            sizes.map(|(name, size)| format!("{}: {}", string(name), short(*size))).collect();
        fields.push(("sizes", format!("{{{}}}", sizes.join(", "))));
        if let Some(twin) = &self.twin {
            fields.push(("twin_of", string(&twin.of)));
            fields.push(("changed", string(twin.change.word())));
            let renamed = twin.renamed.iter();
            let renamed: Vec<String> =
                renamed.map(|(old, new)| format!("{}: {}", string(old), string(new))).collect();
            fields.push(("renamed", format!("{{{}}}", renamed.join(", "))));
        }
        let fields: Vec<String> =
            fields.iter().map(|(key, value)| format!("  {}: {value}", string(key))).collect();
        format!("{{\n{}\n}}\n", fields.join(",\n"))
    }
}

fn string(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

fn strings<'a>(all: impl Iterator<Item = &'a str>) -> String {
    let all: Vec<String> = all.map(string).collect();
    format!("[{}]", all.join(", "))
}

fn numbers(all: &[f64]) -> String {
    let all: Vec<String> = all.iter().map(|x| short(*x)).collect();
    format!("[{}]", all.join(", "))
}
