//! Appends inputs to those of a recording.

use dgd_runtime::{InputColumn, InputError, Inputs, Interpolation, LimitSide};

/// A recording's inputs followed by `further` others, whose values on each side of a time `write` sets; they are zero
/// before it is called.
///
/// Between jumps and kinks every input is a straight line: samples on both sides of each, and of each of `times`,
/// describe it exactly.
pub(crate) fn with_further_inputs(
    inputs: &Inputs,
    times: &[f64],
    further: usize,
    write: impl Fn(f64, LimitSide, &mut [f64]),
) -> Result<Inputs, InputError> {
    let (samples, columns) = sampled(inputs, times, further, write);
    recorded(&samples, &columns)
}

/// A recording's inputs and further constant ones, each with its position among all inputs, in ascending order.
pub(crate) fn with_constant_inputs(
    inputs: &Inputs,
    times: &[f64],
    further: &[(usize, f64)],
) -> Result<Inputs, InputError> {
    let (samples, mut columns) = sampled(inputs, times, 0, |_, _, _| {});
    for (position, value) in further {
        columns.insert(*position, vec![*value; samples.len()]);
    }
    recorded(&samples, &columns)
}

/// Samples on both sides of each time, and of each jump or kink of the inputs.
fn sampled(
    inputs: &Inputs,
    times: &[f64],
    further: usize,
    write: impl Fn(f64, LimitSide, &mut [f64]),
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (from, until) = (times[0], times[times.len() - 1]);
    let mut grid = times.to_vec();
    grid.extend_from_slice(inputs.breakpoints(from, until));
    grid.sort_unstable_by(f64::total_cmp);
    grid.dedup();

    let n_recorded = inputs.len();
    let mut samples = Vec::with_capacity(2 * grid.len());
    let mut columns = vec![Vec::with_capacity(2 * grid.len()); n_recorded + further];
    let mut u = vec![0.0; n_recorded + further];
    for &t in &grid {
        let sides: &[LimitSide] =
            if t == from { &[LimitSide::Right] } else { &[LimitSide::Left, LimitSide::Right] };
        for &side in sides {
            let (of_recording, behind) = u.split_at_mut(n_recorded);
            inputs.value(t, side, of_recording);
            behind.fill(0.0);
            write(t, side, behind);
            samples.push(t);
            for (column, u) in columns.iter_mut().zip(&u) {
                column.push(*u);
            }
        }
    }
    (samples, columns)
}

fn recorded(samples: &[f64], columns: &[Vec<f64>]) -> Result<Inputs, InputError> {
    let columns: Vec<InputColumn<'_>> = columns
        .iter()
        .map(|values| InputColumn { name: "input", interpolation: Interpolation::Linear, values })
        .collect();
    Inputs::recorded(samples, &columns)
}
