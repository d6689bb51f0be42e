//! Effects that fit any model: common faults of sensors, inputs, parameters and balances.
//!
//! They are tried if the library of a model does not explain the recordings. Their texts are in `templates/`.

use dgd_compiler::diagnostics::{Diagnostics, ErrorReported};
use dgd_compiler::effects::Effect;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;

/// The texts by file name.
macro_rules! texts {
    ($($name:literal),* $(,)?) => {
        [$((
            concat!("templates/", $name, ".dgd"),
            include_str!(concat!("../../templates/", $name, ".dgd")),
        )),*]
    };
}

const TEXTS: [(&str, &str); 62] = texts![
    "sensor/sensor_gain",
    "sensor/sensor_offset",
    "sensor/sensor_drift",
    "sensor/sensor_delay",
    "sensor/sensor_lag",
    "sensor/sensor_sampled",
    "sensor/sensor_saturation",
    "sensor/sensor_floor",
    "input/input_gain",
    "input/input_offset",
    "input/input_lag",
    "input/input_delay",
    "input/dead_band",
    "input/input_saturation",
    "input/saturation_below",
    "input/saturation_at_both_ends",
    "input/rate_limit",
    "input/backlash",
    "input/stuck",
    "input/actuator_fault",
    "input/sampled",
    "parameter/parameter_step",
    "parameter/parameter_drift",
    "parameter/curved",
    "parameter/parameter_decay",
    "balance/unmeasured_flow",
    "balance/leak",
    "balance/exchange",
    "surroundings/loss_to",
    "surroundings/loss_to_level",
    "surroundings/play",
    "surroundings/contact",
    "neutral/dead_band_of_state",
    "neutral/dead_band_of_let",
    "balance/end_stop",
    "neutral/loss_beyond",
    "balance/power_loss",
    "balance/dry_friction",
    "balance/creeping_friction",
    "balance/stribeck_friction",
    "neutral/zero_order_loss",
    "neutral/gradual",
    "neutral/falling_loss",
    "balance/cubic_stiffness",
    "balance/quadratic_stiffness",
    "neutral/cubic_term",
    "neutral/quadratic_term",
    "balance/hysteresis",
    "neutral/loss_with_memory",
    "balance/periodic_disturbance",
    "balance/overflow",
    "balance/saturation",
    "parameter/linear",
    "parameter/power",
    "parameter/exponential",
    "parameter/inverse",
    "parameter/inverse_square",
    "parameter/saturating",
    "parameter/saturated",
    "parameter/arrhenius",
    "parameter/falls_with_size",
    "parameter/rises_with_size",
];

/// The templates that come with this library, the plainest first: of two equivalent ones, the first is reported. Their
/// texts are added to `sources`.
///
/// # Errors
///
/// [`ErrorReported`] if one of them cannot be read, which tests exclude.
pub fn templates(
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Effect>, ErrorReported> {
    let read = |(name, text): (&str, &str)| {
        let id = sources.add(SourceText { name: name.to_owned(), text: text.to_owned() });
        parse(id, sources, diagnostics).and_then(|ast| Effect::read(ast, diagnostics))
    };
    TEXTS.into_iter().map(read).collect()
}
