//! The result of a run, by name.

use std::collections::BTreeMap;

use dgd_runtime::ensemble::Trajectory;
use dgd_runtime::{Event, Observations, OneSided, Signature, Statistics, UndefinedSensitivity};

use crate::Error;

/// Unknowns and outputs at the requested times, SI.
#[derive(Debug, Clone, Default)]
pub struct Solution {
    times: Vec<f64>,
    /// Values at all times by name; an output with the name of an unknown equals that unknown.
    values: BTreeMap<String, Vec<f64>>,
    /// Derivatives at all times by the names of numerator and denominator.
    derivatives: BTreeMap<(String, String), Vec<f64>>,
    events: Vec<Event>,
    undefined: Vec<UndefinedSensitivity>,
    one_sided: Vec<OneSided>,
    statistics: Statistics,
}

impl Solution {
    pub(crate) fn new(
        signature: &Signature,
        run: dgd_runtime::Solution,
        outputs: &Observations,
    ) -> Self {
        let (n, n_w, n_s) = (run.n, outputs.n_w, run.n_s);
        let column = |rows: &[f64], width: usize, position: usize| -> Vec<f64> {
            rows.iter().skip(position).step_by(width.max(1)).copied().collect()
        };
        let values = by_name(signature, |i| column(&run.y, n, i), |i| column(&outputs.w, n_w, i));
        let mut derivatives = BTreeMap::new();
        for j in 0..n_s {
            let of_unknown = |i: usize| column(&run.s, n * n_s, j * n + i);
            let of_output = |i: usize| column(&outputs.dw, n_w * n_s, j * n_w + i);
            let parameter = signature.direction_name(j).to_string();
            let slopes = by_name(signature, of_unknown, of_output).into_iter();
            derivatives.extend(slopes.map(|(of, slopes)| ((of, parameter.clone()), slopes)));
        }
        Self {
            times: run.times,
            values,
            derivatives,
            events: run.events,
            undefined: run.undefined,
            one_sided: run.one_sided,
            statistics: run.statistics,
        }
    }

    /// The values of a member of an ensemble.
    pub(crate) fn of_member(signature: &Signature, member: &Trajectory<'_>) -> Self {
        let values =
            by_name(signature, |i| member.unknown(i).to_vec(), |i| member.output(i).to_vec());
        let (times, statistics) = (member.times.to_vec(), member.statistics);
        Self { times, values, statistics, ..Self::default() }
    }

    /// The requested times that were reached, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// An unknown or output at all times, SI.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchName`].
    pub fn get(&self, name: &str) -> Result<&[f64], Error> {
        let values = self.values.get(name).map(Vec::as_slice);
        values.ok_or_else(|| Error::no_such_name("state or output", name, self.values.keys()))
    }

    /// ∂`of`/∂`to` at all times, SI; NaN where it is undefined ([`Solution::undefined`]). `to` is a parameter, or a
    /// state for the derivative with respect to its initial value.
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

    /// Changes of mode, in order of time.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Intervals in which sensitivities are undefined, with the reason.
    pub fn undefined(&self) -> &[UndefinedSensitivity] {
        &self.undefined
    }

    /// Thresholds at which the run began, where the sensitivities that move them are one-sided.
    pub fn one_sided(&self) -> &[OneSided] {
        &self.one_sided
    }

    /// Number of steps and evaluations.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }
}

/// Unknowns and outputs by name; an unknown takes precedence over an output with its name.
fn by_name(
    signature: &Signature,
    unknown: impl Fn(usize) -> Vec<f64>,
    output: impl Fn(usize) -> Vec<f64>,
) -> BTreeMap<String, Vec<f64>> {
    let outputs = signature.outputs.iter().enumerate();
    let outputs = outputs.map(|(i, own)| (own.name.to_string(), output(i)));
    let unknowns = signature.unknowns.iter().enumerate();
    let unknowns = unknowns.map(|(i, own)| (own.name.to_string(), unknown(i)));
    outputs.chain(unknowns).collect()
}
