//! A starting point of a fit.

use dgd_identify::keep_by_fields;

/// A starting point of a fit: values of parameters by name, SI.
#[derive(Debug, Clone, Default)]
pub(crate) struct StartPoint {
    /// Values suggested by the screen.
    pub values: Vec<(String, f64)>,
    /// These values with the candidate at its null: if the suggested values would require large changes in the rest of
    /// the model, a fit is faster from here.
    pub at_nothing: Vec<(String, f64)>,
    /// Names among them that are held until the rest of the model has adapted to them.
    pub held: Vec<String>,
    /// Whether everything else begins at the values of the model's file and not where the fit of a part of it ended: a
    /// model that lacks something may have been fitted to absurd values, from which a fit does not return.
    pub is_afresh: bool,
}

impl StartPoint {
    /// This point with the candidate at its null, and everything else at the values of the model's file.
    pub(crate) fn afresh(&self) -> StartPoint {
        let values = self.at_nothing.clone();
        StartPoint { at_nothing: values.clone(), values, held: Vec::new(), is_afresh: true }
    }

    /// Sets inner constants.
    pub(crate) fn set(&mut self, inner: impl Iterator<Item = (String, f64)>) {
        for constant in inner {
            self.values.push(constant.clone());
            self.at_nothing.push(constant);
        }
    }

    /// One of the suggested values; NaN if there is none.
    pub(crate) fn value(&self, name: &str) -> f64 {
        let suggested = self.values.iter().find(|(other, _)| other == name);
        suggested.map_or(f64::NAN, |(_, value)| *value)
    }
}

keep_by_fields!(StartPoint { values, at_nothing, held, is_afresh });
