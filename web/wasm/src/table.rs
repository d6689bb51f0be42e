//! Recordings as text: a header of names, then rows of numbers in the units that the model declares.

use dgd_runtime::{InputColumn, Inputs, Signature, Unit};

/// The columns of a recording.
#[derive(Debug)]
pub(crate) struct Table<'a> {
    names: Vec<&'a str>,
    /// A list of values for each column.
    columns: Vec<Vec<f64>>,
}

impl<'a> Table<'a> {
    /// Reads `time,name …` or `time [unit],name [unit] …` and rows, of which those before a time are kept.
    pub(crate) fn read(text: &'a str, until: f64) -> Self {
        let mut lines = text.lines();
        let header = lines.next().expect("a header");
        let names: Vec<&str> =
            header.split(',').filter_map(|cell| cell.split_whitespace().next()).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            let row: Vec<f64> =
                line.split(',').map(|cell| cell.trim().parse().expect("a number")).collect();
            if row[0] >= until {
                break;
            }
            for (column, value) in columns.iter_mut().zip(row) {
                column.push(value);
            }
        }
        Self { names, columns }
    }

    /// Times, s.
    pub(crate) fn times(&self) -> &[f64] {
        &self.columns[0]
    }

    /// A column in SI, if there is one with that name.
    pub(crate) fn in_si(&self, name: &str, unit: &Unit) -> Option<Vec<f64>> {
        let position = self.names.iter().position(|column| *column == name)?;
        Some(self.columns[position].iter().map(|value| value * unit.factor + unit.offset).collect())
    }

    /// A model's inputs.
    pub(crate) fn inputs(&self, signature: &Signature) -> Inputs {
        let recorded: Vec<Vec<f64>> = (signature.inputs.iter())
            .map(|input| self.in_si(&input.name, &input.unit).expect("all inputs are recorded"))
            .collect();
        let columns: Vec<InputColumn<'_>> = (signature.inputs.iter().zip(&recorded))
            .map(|(input, values)| InputColumn {
                name: &input.name,
                interpolation: input.interpolation,
                values,
            })
            .collect();
        Inputs::recorded(self.times(), &columns).expect("inputs at all times")
    }
}
