//! Section 3.8: the inertia of the return line.

use crate::Fallible;
use crate::friction::Polynomial;
use crate::model::{Choices, Model};
use crate::pump::Pump;

/// The return line with what is identified, levels being measured.
pub(crate) fn return_flow(friction: &Polynomial, pump: &Pump, inertia: f64) -> Fallible<Model> {
    Model::load("examples/thesis/return_flow.dgd", &Choices::default())?.with(&[
        ("c0", pump.c0),
        ("k", pump.k),
        ("c2", pump.c2),
        ("F1", friction[0]),
        ("F2", friction[1]),
        ("F3", friction[2]),
        ("F4", friction[3]),
        ("M_ssp", inertia),
    ])
}
