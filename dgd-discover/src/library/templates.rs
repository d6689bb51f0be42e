//! Effects that fit any model: what sensors, inputs, parameters and balances of all kinds may have.
//!
//! They are tried where the library of a model explains nothing. Their texts are in `templates/`.

use dgd_compiler::diagnostics::{Diagnostics, Reported};
use dgd_compiler::effects::Effect;
use dgd_compiler::source::{Source, Sources};
use dgd_compiler::syntax::parse;

/// The texts by name of the file.
macro_rules! texts {
    ($($name:literal),* $(,)?) => {
        [$((
            concat!("templates/", $name, ".dgd"),
            include_str!(concat!("../../templates/", $name, ".dgd")),
        )),*]
    };
}

const TEXTS: [(&str, &str); 18] = texts![
    "sensor_gain",
    "sensor_offset",
    "sensor_drift",
    "sensor_delay",
    "sensor_lag",
    "sensor_saturation",
    "input_gain",
    "input_offset",
    "input_lag",
    "dead_band",
    "parameter_step",
    "parameter_drift",
    "unmeasured_flow",
    "leak",
    "power_loss",
    "dry_friction",
    "overflow",
    "saturation",
];

/// The templates that come with this library; their texts go into `sources`.
///
/// # Errors
///
/// [`Reported`] where one of them cannot be read, which tests exclude.
pub fn templates(
    sources: &mut Sources,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Effect>, Reported> {
    let read = |(name, text): (&str, &str)| {
        let id = sources.add(Source { name: name.to_owned(), text: text.to_owned() });
        parse(id, sources, diagnostics).and_then(|ast| Effect::read(ast, diagnostics))
    };
    TEXTS.into_iter().map(read).collect()
}
