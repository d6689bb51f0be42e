//! Where a fit may begin.

use dgd_identify::keep_by_fields;

/// Where a fit may begin: values of parameters by name, SI.
#[derive(Debug, Clone, Default)]
pub(crate) struct StartPoint {
    /// What the screen suggests.
    pub values: Vec<(String, f64)>,
    /// The same with the candidate at nothing: where the rest of the model would have to move a lot to go
    /// with what is suggested, a fit is quicker from here.
    pub at_nothing: Vec<(String, f64)>,
}

impl StartPoint {
    /// Takes over inner constants.
    pub(crate) fn set(&mut self, inner: impl Iterator<Item = (String, f64)>) {
        for constant in inner {
            self.values.push(constant.clone());
            self.at_nothing.push(constant);
        }
    }

    /// One of the suggested values; NaN where there is none.
    pub(crate) fn value(&self, name: &str) -> f64 {
        let found = self.values.iter().find(|(other, _)| other == name);
        found.map_or(f64::NAN, |(_, value)| *value)
    }
}

keep_by_fields!(StartPoint { values, at_nothing });
