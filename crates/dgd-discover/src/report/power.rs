//! Detection limits: the smallest effects of the library that the recordings would have revealed.

use dgd_runtime::{System, Unit};

use crate::library::StructureId;
use crate::search::{EffectSearch, Screen};

/// The smallest size at which an effect would have been detected.
#[derive(Debug, Clone)]
pub struct DetectionPower {
    /// The effect, with its arguments.
    pub name: String,
    /// The parameter that gives its size.
    pub parameter: String,
    /// Its unit.
    pub unit: Unit,
    /// Smallest detectable distance from its null, SI.
    pub smallest: f64,
}

/// For each effect of the library with a single size parameter: its minimum distance from null to be worth including in
/// the base model, to first order. For an effect with an onset, at the middle one of those tried.
pub(crate) fn power(search: &EffectSearch<'_>, screen: &Screen) -> Vec<DetectionPower> {
    let samples = search.training_error(StructureId::BASE).map_or(1, |(_, n)| n) as f64;
    let mut powers: Vec<DetectionPower> = Vec::new();
    let library = search.candidates.iter().enumerate().filter(|(_, one)| !one.is_generic);
    for (candidate, _) in library {
        let trials = screen.trials.iter().filter(|trial| trial.candidate == candidate);
        let lengths = trials.filter_map(|trial| match trial.contrasts.as_slice() {
            [only] => Some(only.length()),
            _ => None,
        });
        let mut lengths: Vec<f64> = lengths.filter(|length| *length > 0.0).collect();
        lengths.sort_by(f64::total_cmp);
        let Some(length) = lengths.get(lengths.len() / 2) else { continue };
        let Ok(structure) = search.base.structure(search.candidates, StructureId::one(candidate))
        else {
            continue;
        };
        let brought = structure.brought.first();
        let Some([name]) = brought.map(|brought| brought.null.as_slice()) else { continue };
        let mut parameters = structure.system.signature().parameters.iter();
        let Some(parameter) = parameters.find(|p| *p.name == **name) else { continue };
        let numbers = brought.map_or(1, |brought| brought.parameters.len()) as f64;
        let gain = search.thresholds.least_gain + numbers * samples.ln();
        powers.push(DetectionPower {
            name: search.called(candidate),
            parameter: name.clone(),
            unit: parameter.unit.clone(),
            smallest: gain.sqrt() / length,
        });
    }
    powers
}
