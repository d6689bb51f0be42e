//! Files of the repository as text, because WebAssembly has no files; and the compilation of their models.

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;

macro_rules! texts {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_str!(concat!("../../../models/", $path)))),*]
    };
}

/// Models and their imports, by path below `models`.
const MODELS: &[(&str, &str)] = texts![
    "controlled_level.dgd",
    "cstr.dgd",
    "delayed_sensor.dgd",
    "dragged_load.dgd",
    "every_intrinsic.dgd",
    "lib/friction.dgd",
    "mud_circulation.dgd",
    "parts/pi_controller.dgd",
    "parts/tank.dgd",
    "pendulum_cartesian.dgd",
    "pipe_flow.dgd",
    "rc_circuit.dgd",
    "remote_level.dgd",
    "rigid_tanks.dgd",
    "robertson.dgd",
    "tank_with_weir.dgd",
    "transmission_line.dgd",
];

/// Effects that may explain the mud circulation, by path below `models`.
pub(crate) const EFFECTS: &[(&str, &str)] = texts![
    "effects/booster_flow_gain.dgd",
    "effects/booster_u_tubing/column_with_momentum.dgd",
    "effects/booster_u_tubing/delay_and_integrator.dgd",
    "effects/booster_u_tubing/turbulent_column.dgd",
    "effects/booster_u_tubing/weighted_column.dgd",
    "effects/clock_shift.dgd",
    "effects/density_change.dgd",
    "effects/flow_meter_delay.dgd",
    "effects/flow_meter_gain.dgd",
    "effects/flow_meter_offset.dgd",
    "effects/friction_higher_order.dgd",
    "effects/mud_loss.dgd",
    "effects/pressure_sensor_drift.dgd",
    "effects/pressure_sensor_offset.dgd",
    "effects/pump_speed_exponent.dgd",
    "effects/pump_speed_lag.dgd",
    "effects/pump_wear.dgd",
    "effects/return_line_plugging.dgd",
    "effects/top_fill_gain.dgd",
    "effects/well_influx.dgd",
];

/// A recording in which the booster pump stops, which is not in the model, and another.
pub(crate) const BOOSTER_STOP: [&str; 2] = [
    include_str!("../../../examples/data/booster_stop.train.csv"),
    include_str!("../../../examples/data/booster_stop.valid.csv"),
];

/// The text of a model or of an import.
fn model(path: &str) -> Result<String, String> {
    let entry = MODELS.iter().find(|(name, _)| *name == path);
    entry.map(|(_, text)| (*text).to_owned()).ok_or_else(|| format!("{path} is not included"))
}

/// A model with these variants and sensitivities; its texts are added to `sources`.
pub(crate) fn compiled(
    path: &str,
    variants: &[(&str, &str)],
    directions: &SensitivityDirections,
    sources: &mut SourceMap,
) -> CompiledStages {
    let name = |text: &str| Name { text: text.to_owned(), span: Span::default() };
    let variants = variants.iter().map(|(variant, choice)| (name(variant), name(choice)));
    let options = ModelOptions { variants: variants.collect(), ..ModelOptions::default() };
    let text = model(path).expect("the model is included");
    let main = SourceText { name: path.to_owned(), text };
    let mut diagnostics = Diagnostics::default();
    compile(main, &options, directions, &mut |path| model(path), sources, &mut diagnostics)
        .unwrap_or_else(|_| panic!("{}", shown(&diagnostics, sources)))
}

pub(crate) fn shown(diagnostics: &Diagnostics, sources: &SourceMap) -> String {
    render::render(&diagnostics.sorted(), sources, render::RenderStyle::Plain)
}
