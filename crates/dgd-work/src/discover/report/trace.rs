//! `unexplained.csv`: the missing term of each equation that no effect explains.

use dgd_data::write::{OutputColumn, write_table};
use dgd_discover::{MissingInput, UnexplainedError};
use dgd_runtime::Unit;

use crate::error::{OutputPart, UnusableFile, WorkError};

/// A table of time, value and standard deviation for each equation; `None` if everything is explained.
///
/// All traces are of one recording. A trace without a sample at a time of the first one has no value there.
pub(super) fn table(unexplained: &[UnexplainedError]) -> Result<Option<Vec<u8>>, WorkError> {
    let Some(first) = unexplained.first() else {
        return Ok(None);
    };
    let mut columns: Vec<(String, Unit, Vec<f64>)> = Vec::new();
    for UnexplainedError { trace, .. } in unexplained {
        let unit = Unit { symbol: trace.unit.clone().into(), factor: 1.0, offset: 0.0 };
        let times = &first.trace.times;
        if columns.iter().any(|(name, ..)| *name == trace.target()) {
            continue;
        }
        columns.push((trace.target(), unit.clone(), interpolate(trace, &trace.value, times)));
        columns.push((
            format!("{}_std", trace.target()),
            unit,
            interpolate(trace, &trace.std, times),
        ));
    }
    let columns: Vec<OutputColumn<'_>> =
        columns.iter().map(|(name, unit, values)| OutputColumn::new(name, unit, values)).collect();
    let mut text = Vec::new();
    write_table(&mut text, Some(&first.trace.times), &columns)
        .map_err(|error| UnusableFile::Output { what: OutputPart::Table, error })?;
    Ok(Some(text))
}

fn interpolate(trace: &MissingInput, values: &[f64], times: &[f64]) -> Vec<f64> {
    let index = |k: usize, t: f64| match trace.times.get(k) {
        Some(&same) if same == t => Some(k),
        _ => trace.times.binary_search_by(|other| other.total_cmp(&t)).ok(),
    };
    let value = |k, t| index(k, t).and_then(|k| values.get(k)).copied().unwrap_or(f64::NAN);
    times.iter().enumerate().map(|(k, &t)| value(k, t)).collect()
}
