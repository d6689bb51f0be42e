//! What an equation reads, with the names that the user wrote.

use crate::error::ReadValue;
use crate::system::{Pattern, Signature};

/// Values of the unknowns, inputs and delayed inputs that the equation in a row reads.
pub(crate) fn read_values(
    signature: &Signature,
    row: usize,
    y: &[f64],
    u: &[f64],
) -> Vec<ReadValue> {
    let of_row = |pattern: &Pattern| -> Vec<usize> {
        let mut columns: Vec<usize> =
            pattern.positions().filter(|(r, _)| *r == row).map(|(_, column)| column).collect();
        columns.sort_unstable();
        columns
    };
    let unknowns = of_row(&signature.jacobian).into_iter().map(|i| {
        let unknown = &signature.unknowns[i];
        ReadValue::new(unknown.name.to_string(), y[i], &unknown.unit)
    });
    let n_inputs = signature.inputs.len();
    // Behind the delayed inputs come their slopes, which nobody wrote.
    let inputs = of_row(&signature.input_jacobian).into_iter().filter_map(|i| {
        let delayed = i.checked_sub(n_inputs).map(|late| signature.delayed_inputs.get(late));
        let (name, input) = match delayed {
            None => (signature.inputs[i].name.to_string(), &signature.inputs[i]),
            Some(late) => {
                let late = late?;
                let input = &signature.inputs[late.input];
                (format!("delay({}, {})", input.name, signature.delays[late.delay]), input)
            }
        };
        Some(ReadValue::new(name, u[i], &input.unit))
    });
    unknowns.chain(inputs).collect()
}
