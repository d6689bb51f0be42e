//! Samples of the inputs as functions of time over the current interval.
//!
//! The filter stores as many rows as delayed inputs reach back, and two more.

use std::collections::VecDeque;

use dgd_runtime::{InputColumn, InputError, Inputs, Signature};

use super::error::FilterError;

/// A row of inputs.
#[derive(Debug, Clone)]
struct InputRow {
    t: f64,
    u: Vec<f64>,
}

/// Rows of inputs as they arrive.
#[derive(Debug, Clone, Default)]
pub(super) struct InputHistory {
    rows: VecDeque<InputRow>,
    /// Number of missing values so far, for each input.
    pub missing: Vec<usize>,
}

impl InputHistory {
    /// Adds a row; a missing value is replaced by the last one.
    pub(super) fn push(
        &mut self,
        t: f64,
        u: &[f64],
        signature: &Signature,
    ) -> Result<(), FilterError> {
        let inputs = |error| Err(FilterError::Inputs(error));
        if !t.is_finite() {
            return inputs(InputError::TimeNotFinite { sample: self.rows.len() });
        }
        if let Some(last) = self.rows.back()
            && t < last.t
        {
            return inputs(InputError::TimeBackwards { at: t, previous: last.t });
        }
        self.missing.resize(u.len(), 0);
        let last = self.rows.back().map(|row| row.u.clone());
        let mut filled = u.to_vec();
        for (i, value) in filled.iter_mut().enumerate() {
            if value.is_finite() {
                continue;
            }
            let Some(last) = &last else {
                let input = signature.inputs[i].name.to_string();
                return Err(FilterError::FirstInput { input });
            };
            *value = last[i];
            self.missing[i] += 1;
        }
        let [before, last] = [1, 0].map(|k| self.rows.iter().rev().nth(k));
        if let (Some(before), Some(last)) = (before, last)
            && before.t == t
            && last.t == t
        {
            let differs =
                |(i, u): (usize, &f64)| (*u != last.u[i] || last.u[i] != before.u[i]).then_some(i);
            return match filled.iter().enumerate().find_map(differs) {
                // A replicate has no new inputs.
                None => Ok(()),
                Some(i) => {
                    let input = signature.inputs[i].name.to_string();
                    inputs(InputError::TimeRepeated { at: t, input })
                }
            };
        }
        self.rows.push_back(InputRow { t, u: filled });
        Ok(())
    }

    /// Drops rows that no delay reaches: those more than `reach` before the last but one.
    pub(super) fn forget(&mut self, reach: f64) {
        let Some(from) = self.rows.iter().rev().nth(1).map(|row| row.t - reach) else { return };
        while self.rows.len() > 2 && self.rows[1].t < from {
            self.rows.pop_front();
        }
    }

    /// The stored rows as functions of time.
    pub(super) fn inputs(&self, signature: &Signature) -> Result<Inputs, FilterError> {
        if let [only] = self.rows.as_slices().0
            && self.rows.len() == 1
        {
            return Ok(Inputs::constant(&only.u));
        }
        let times: Vec<f64> = self.rows.iter().map(|row| row.t).collect();
        let values: Vec<Vec<f64>> = (0..signature.inputs.len())
            .map(|i| self.rows.iter().map(|row| row.u[i]).collect())
            .collect();
        let columns: Vec<InputColumn<'_>> = signature
            .inputs
            .iter()
            .zip(&values)
            .map(|(input, values)| InputColumn {
                name: &input.name,
                interpolation: input.interpolation,
                values,
            })
            .collect();
        Inputs::recorded(&times, &columns).map_err(FilterError::Inputs)
    }
}
