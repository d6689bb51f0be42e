//! The identification from beginning to end.

use std::error::Error;

use crate::field::Field;
use crate::page::Section;
use crate::verification::Identified;
use crate::{
    booster, curves, flow_correction, friction, inertia, pump, sensitivity, sensors, verification,
};

/// What may fail, and says why.
pub(crate) type Fallible<T> = Result<T, Box<dyn Error>>;

/// All sections, each with what those before it have identified.
pub(crate) fn all() -> Fallible<Vec<Section>> {
    let pump_tests = Field::read("pump_tests")?;
    let circulation = Field::read("normal_circulation")?;
    let ramps = Field::read("booster_ramps")?;
    let restarts = Field::read("booster_restarts")?;

    let (friction_section, friction) = friction::identify(&pump_tests)?;
    let (pump_section, pump) = pump::identify(&pump_tests, &circulation, &friction)?;
    let (flow_section, theta_1) = flow_correction::identify(&circulation)?;
    let (booster_section, booster) = booster::identify(&restarts, theta_1)?;
    let (inertia_section, inertia) = inertia::identify(&ramps, &friction, &pump)?;
    let identified = Identified { friction, pump, theta_1, booster, inertia };
    Ok(vec![
        curves::draw(&[])?,
        sensitivity::draw(&[])?,
        sensors::screen(&Field::read("no_flow")?),
        friction_section,
        pump_section,
        flow_section,
        booster_section,
        inertia_section,
        verification::draw(&circulation, &restarts, &identified)?,
    ])
}
