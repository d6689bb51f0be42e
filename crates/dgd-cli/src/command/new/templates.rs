//! Project templates: a model, two recordings and a library of effects, one of which is hidden in the recordings.
//!
//! The recordings come from simulators in plain Rust that share no code with the product: those of
//! `bench/discovery_bank`, and `examples/hidden_effects.rs` for drilling. `truth.json` names the hidden effect.

/// A project template.
#[derive(Debug)]
pub(super) struct ProjectTemplate {
    /// Its name on the command line.
    pub(super) name: &'static str,
    /// A sentence about the plant.
    pub(super) about: &'static str,
    /// Name of the model, and of its file without `.dgd`.
    pub(super) model: &'static str,
    /// The model's text.
    pub(super) text: &'static str,
    /// Paths below `effects` without `.dgd`, with the texts.
    pub(super) effects: &'static [(&'static str, &'static str)],
    /// The training and validation recordings, CSV.
    pub(super) recordings: [&'static [u8]; 2],
    /// The hidden effect, for programs.
    pub(super) truth: &'static str,
}

/// A file of this repository, by its path from the root.
macro_rules! file {
    ($($path:expr),*) => {
        concat!("../../../../../", $($path),*)
    };
}

macro_rules! template {
    ($name:literal, $about:literal, $folder:literal, $model:literal, $file:literal,
     [$train:literal, $valid:literal, $truth:literal], [$($effect:literal),* $(,)?]) => {
        ProjectTemplate {
            name: $name,
            about: $about,
            model: $model,
            text: include_str!(file!($folder, "/", $file, ".dgd")),
            effects: &[$(($effect, include_str!(file!($folder, "/effects/", $effect, ".dgd")))),*],
            recordings: [include_bytes!(file!($train)), include_bytes!(file!($valid))],
            truth: include_str!(file!($truth)),
        }
    };
}

/// All templates.
pub(super) static TEMPLATES: &[ProjectTemplate] = &[
    template!(
        "motor",
        "A DC motor on a test bench: voltage and brake torque in, current and speed out.",
        "bench/discovery_bank/domains/electrical/dc_motor",
        "dc_motor",
        "model",
        [
            "crates/dgd-cli/templates/motor/train.csv",
            "crates/dgd-cli/templates/motor/valid.csv",
            "crates/dgd-cli/templates/motor/truth.json"
        ],
        [
            "amplifier_dead_band",
            "armature_reaction",
            "brake_gain",
            "brush_drop",
            "coulomb_friction",
            "fading_magnet",
            "quadratic_drag",
            "tachometer_lag",
            "winding_heating",
        ]
    ),
    template!(
        "tank",
        "Two tanks in a row: pump flow and valve opening in, two levels and the outflow out.",
        "bench/discovery_bank/domains/process/two_tanks",
        "two_tanks",
        "model",
        [
            "crates/dgd-cli/templates/tank/train.csv",
            "crates/dgd-cli/templates/tank/valid.csv",
            "crates/dgd-cli/templates/tank/truth.json"
        ],
        [
            "bypass",
            "clogged_passage",
            "conical_tank",
            "leak_lower",
            "leak_upper",
            "overflow_pipe",
            "pump_wear",
            "valve_characteristic",
        ]
    ),
    template!(
        "exchanger",
        "A heat exchanger: two flows and their inlet temperatures in, two outlet temperatures out.",
        "bench/discovery_bank/domains/thermal/heat_exchanger",
        "heat_exchanger",
        "model",
        [
            "crates/dgd-cli/templates/exchanger/train.csv",
            "crates/dgd-cli/templates/exchanger/valid.csv",
            "crates/dgd-cli/templates/exchanger/truth.json"
        ],
        [
            "air_pocket",
            "fouling_asymptotic",
            "fouling_linear",
            "fouling_washed",
            "heat_loss",
            "hot_bypass",
            "hot_film_exponent",
            "internal_leak",
            "viscous_film",
            "wall_cleaned",
        ]
    ),
    template!(
        "battery",
        "A lithium cell: current in, voltage and temperature out.",
        "bench/discovery_bank/domains/electrical/battery",
        "battery",
        "model",
        [
            "crates/dgd-cli/templates/battery/train.csv",
            "crates/dgd-cli/templates/battery/valid.csv",
            "crates/dgd-cli/templates/battery/truth.json"
        ],
        [
            "charge_transfer",
            "cold_resistance",
            "coulombic_loss",
            "empty_resistance",
            "entropic_heat",
            "hysteresis",
            "natural_convection",
            "second_rc",
            "self_discharge",
            "tab_heat",
        ]
    ),
    template!(
        "reactor",
        "An exothermic reaction in a cooled stirred tank: feed and coolant in, concentration and temperatures out.",
        "bench/discovery_bank/domains/process/cstr",
        "cstr",
        "model",
        [
            "crates/dgd-cli/templates/reactor/train.csv",
            "crates/dgd-cli/templates/reactor/valid.csv",
            "crates/dgd-cli/templates/reactor/truth.json"
        ],
        [
            "catalyst_decay",
            "coolant_film",
            "heat_loss",
            "jacket_scale",
            "product_inhibition",
            "reaction_order",
            "reverse_reaction",
            "short_circuit",
            "side_reaction",
            "stirrer_heat",
        ]
    ),
    template!(
        "circuit",
        "A step-down converter: duty, supply and load in, coil current and output voltage out.",
        "bench/discovery_bank/domains/electrical/buck",
        "buck",
        "model",
        [
            "crates/dgd-cli/templates/circuit/train.csv",
            "crates/dgd-cli/templates/circuit/valid.csv",
            "crates/dgd-cli/templates/circuit/truth.json"
        ],
        [
            "capacitor_resistance",
            "ceramic_capacitor",
            "core_saturation",
            "dead_time",
            "diode_drop",
            "lamp_heating",
            "modulator_delay",
            "sense_filter",
            "switch_resistance",
        ]
    ),
    template!(
        "vehicle",
        "A car on a hilly road: drive force, brake and slope in, speed and acceleration out.",
        "bench/discovery_bank/domains/mechanical/vehicle",
        "vehicle",
        "model",
        [
            "crates/dgd-cli/templates/vehicle/train.csv",
            "crates/dgd-cli/templates/vehicle/valid.csv",
            "crates/dgd-cli/templates/vehicle/truth.json"
        ],
        [
            "brake_fade",
            "brake_over_speed",
            "cold_tyres",
            "drive_lag",
            "driveline_loss",
            "engine_braking",
            "headwind",
            "power_limit",
            "rolling_over_speed",
            "rotating_mass",
        ]
    ),
    template!(
        "drilling",
        "Mud circulation of a dual gradient well: pump speed and flows in, pressures and return flow out.",
        "models",
        "mud_circulation",
        "mud_circulation",
        [
            "examples/data/booster_stop.train.csv",
            "examples/data/booster_stop.valid.csv",
            "examples/data/booster_stop.truth.json"
        ],
        [
            "booster_flow_gain",
            "booster_u_tubing/column_with_momentum",
            "booster_u_tubing/delay_and_integrator",
            "booster_u_tubing/turbulent_column",
            "booster_u_tubing/weighted_column",
            "clock_shift",
            "density_change",
            "flow_meter_delay",
            "flow_meter_gain",
            "flow_meter_offset",
            "friction_higher_order",
            "mud_loss",
            "pressure_sensor_drift",
            "pressure_sensor_offset",
            "pump_speed_exponent",
            "pump_speed_lag",
            "pump_wear",
            "return_line_plugging",
            "top_fill_gain",
            "well_influx",
        ]
    ),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};

    use super::*;

    fn effects_below(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("the repository is there").flatten() {
            if entry.path().is_dir() {
                effects_below(&entry.path(), found);
            } else {
                found.push(entry.path());
            }
        }
    }

    #[test]
    fn every_library_is_whole() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("a workspace");
        for (template, folder) in TEMPLATES.iter().zip([
            "bench/discovery_bank/domains/electrical/dc_motor",
            "bench/discovery_bank/domains/process/two_tanks",
            "bench/discovery_bank/domains/thermal/heat_exchanger",
            "bench/discovery_bank/domains/electrical/battery",
            "bench/discovery_bank/domains/process/cstr",
            "bench/discovery_bank/domains/electrical/buck",
            "bench/discovery_bank/domains/mechanical/vehicle",
            "models",
        ]) {
            let folder = root.join(folder).join("effects");
            let mut files = Vec::new();
            effects_below(&folder, &mut files);
            let there: BTreeSet<PathBuf> = files.into_iter().collect();
            let listed: BTreeSet<PathBuf> = template
                .effects
                .iter()
                .map(|(name, _)| folder.join(format!("{name}.dgd")))
                .collect();
            assert_eq!(listed, there, "{}", template.name);
        }
    }
}
