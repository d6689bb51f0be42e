//! What a run gives, by name.

use std::collections::BTreeMap;

use dgd_runtime::{Event, Observations, Signature, Statistics, UndefinedSensitivity};

use crate::Error;

/// Unknowns and outputs at the asked times, SI.
#[derive(Debug, Clone, Default)]
pub struct Solution {
    times: Vec<f64>,
    /// Values at all times by name; an output that has the name of an unknown is that unknown.
    values: BTreeMap<String, Vec<f64>>,
    /// Derivatives at all times by the names of what and to what.
    derivatives: BTreeMap<(String, String), Vec<f64>>,
    events: Vec<Event>,
    undefined: Vec<UndefinedSensitivity>,
    statistics: Statistics,
}

impl Solution {
    pub(crate) fn empty() -> Self {
        Self::default()
    }

    pub(crate) fn new(
        signature: &Signature,
        run: dgd_runtime::Solution,
        outputs: &Observations,
    ) -> Self {
        let every = |values: &[f64], width: usize, position: usize| -> Vec<f64> {
            values.iter().skip(position).step_by(width.max(1)).copied().collect()
        };
        let (n, n_w, n_s) = (run.n, outputs.n_w, run.n_s);
        let directions: Vec<String> =
            (0..n_s).map(|j| signature.direction_name(j).to_string()).collect();
        let mut values = BTreeMap::new();
        let mut derivatives = BTreeMap::new();
        // Unknowns last, so that they are what stays of two of one name.
        for (i, output) in signature.outputs.iter().enumerate() {
            values.insert(output.name.to_string(), every(&outputs.w, n_w, i));
            for (j, to) in directions.iter().enumerate() {
                let slopes = every(&outputs.dw, n_w * n_s, j * n_w + i);
                derivatives.insert((output.name.to_string(), to.clone()), slopes);
            }
        }
        for (i, unknown) in signature.unknowns.iter().enumerate() {
            values.insert(unknown.name.to_string(), every(&run.y, n, i));
            for (j, to) in directions.iter().enumerate() {
                let slopes = every(&run.s, n * n_s, j * n + i);
                derivatives.insert((unknown.name.to_string(), to.clone()), slopes);
            }
        }
        Self {
            times: run.times,
            values,
            derivatives,
            events: run.events,
            undefined: run.undefined,
            statistics: run.statistics,
        }
    }

    /// The asked times that were reached, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// An unknown or output at all times, SI.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchName`].
    pub fn get(&self, name: &str) -> Result<&[f64], Error> {
        let found = self.values.get(name).map(Vec::as_slice);
        found.ok_or_else(|| Error::no_such_name("state or output", name, self.values.keys()))
    }

    /// ∂`of`/∂`to` at all times, SI; NaN where it is undefined ([`Solution::undefined`]). `to` is a parameter,
    /// or a state for the derivative to its start value.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchName`], [`Error::NoSensitivity`].
    pub fn sensitivity(&self, of: &str, to: &str) -> Result<&[f64], Error> {
        self.get(of)?;
        let key = (of.to_owned(), to.to_owned());
        self.derivatives.get(&key).map(Vec::as_slice).ok_or_else(|| Error::NoSensitivity {
            to: to.to_owned(),
            names: self
                .derivatives
                .keys()
                .filter(|(own, _)| own == of)
                .map(|(_, to)| to.clone())
                .collect(),
        })
    }

    /// Names of the unknowns and outputs.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.values.keys().map(String::as_str)
    }

    /// Changes of mode, in the order in which they happened.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Where sensitivities are undefined, and why.
    pub fn undefined(&self) -> &[UndefinedSensitivity] {
        &self.undefined
    }

    /// Work done.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }
}
