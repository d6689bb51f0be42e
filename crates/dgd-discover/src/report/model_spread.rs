//! Uncertainty of estimates because of remaining model error.
//!
//! ```text
//!   s² = s_parts² + max (θ' − θ)²      θ': the same parameter in a structure that does nearly as well
//! ```
//!
//! s_parts is the spread between parts of the recordings ([`dgd_identify::Jackknife`]), with each output weighted by
//! its residuals. Both show only disagreements between parts or structures.

use std::collections::BTreeMap;

use dgd_identify::{OutputErrorProblem, ParameterEstimate, SpreadAt, spread};
use dgd_runtime::Direction;

use super::reason::ExcessOutput;
use crate::fit::{FittedStructure, SearchData, with_starts};
use crate::library::StructureId;
use crate::search::EffectSearch;

/// Standard deviations due to remaining model error, SI, by parameter name; empty if nothing remains.
#[derive(Debug, Clone, Default)]
pub(crate) struct ModelSpread(BTreeMap<String, f64>);

impl ModelSpread {
    /// The spreads of the parameters of a structure, fitted as reported.
    pub(crate) fn from_structure(
        search: &EffectSearch<'_>,
        structure: StructureId,
        fitted: &FittedStructure,
        data: &SearchData<'_>,
    ) -> Self {
        if ExcessOutput::find(fitted, data, &search.thresholds).is_none() {
            return Self::default();
        }
        let Some(over_parts) = over_parts(fitted, data) else { return Self::default() };
        let near = search.near(structure);
        let both = |(name, std): (String, f64)| {
            let value = fitted.values.p.get(&name).copied();
            let off = value.map_or(0.0, |value| {
                let others = near
                    .iter()
                    .filter_map(|other| estimate_in(search, (structure, fitted), *other, &name));
                others.map(|other| (other - value).abs()).fold(0.0, f64::max)
            });
            (name, std.hypot(off))
        };
        Self(over_parts.into_iter().map(both).collect())
    }

    /// The spread of a parameter; `None` if nothing remains, or if it is unknown.
    pub(crate) fn get(&self, name: &str) -> Option<f64> {
        self.0.get(name).copied()
    }
}

/// The spread between parts of the training recordings, by parameter name.
fn over_parts(fitted: &FittedStructure, data: &SearchData<'_>) -> Option<Vec<(String, f64)>> {
    let system = &fitted.structure.system;
    let is_moment = |of: &Direction| match of {
        Direction::Parameter(i) => fitted.moments.contains(i),
        Direction::Start(_) => false,
    };
    let estimates: Vec<ParameterEstimate> =
        fitted.estimates.iter().filter(|estimate| !is_moment(&estimate.of)).cloned().collect();
    let recordings = with_starts(data.train, &fitted.values, &fitted.structure);
    let residuals = fitted.residuals(data);
    let left = |output: usize| {
        let errors =
            residuals.iter().flat_map(|outputs| &outputs[output]).filter(|e| e.is_finite());
        let (sum, n) = errors.fold((0.0, 0), |(sum, n), e| (sum + e * e, n + 1));
        (sum > 0.0).then(|| (sum / f64::from(n)).sqrt())
    };
    let sigma: Vec<Option<f64>> = (data.noise.iter().enumerate())
        .map(|(output, noise)| noise.as_ref().and_then(|_| left(output)))
        .collect();
    let problem = OutputErrorProblem {
        options: data.options,
        threads: 1,
        ..OutputErrorProblem::new(system.as_model(), &fitted.p, &recordings)
    };
    let point = SpreadAt { p: &fitted.p, estimates: &estimates, sigma: &sigma };
    // On failure, only the ordinary standard deviation is reported.
    let spreads = spread(&problem, point).ok().flatten()?;
    let known = estimates.into_iter().zip(spreads.std);
    Some(known.filter_map(|(estimate, std)| Some((estimate.name, std?))).collect())
}

/// The estimate of a structure's parameter in another structure; `None` if the other lacks it, gives it another
/// meaning, or does not determine it.
fn estimate_in(
    search: &EffectSearch<'_>,
    (structure, own): (StructureId, &FittedStructure),
    other: StructureId,
    name: &str,
) -> Option<f64> {
    let fitted = search.fitted(other)?;
    let brought = structure.effects().find_map(|effect| {
        let names = &own.structure.brought_by(effect)?.names;
        let (of_effect, _) = names.iter().find(|(_, known)| known == name)?;
        Some((effect, of_effect))
    });
    let called = match brought {
        None => name,
        Some((effect, of_effect)) => {
            let names = &fitted.structure.brought_by(effect)?.names;
            let (_, known) = names.iter().find(|(own, _)| own == of_effect)?;
            known.as_str()
        }
    };
    // A parameter that an effect replaces is no longer the same parameter.
    if other.effects().any(|effect| search.candidates[effect].target() == called) {
        return None;
    }
    let matching = fitted.estimates.iter().find(|estimate| {
        estimate.name == called && estimate.recording.is_none() && estimate.std.is_some()
    });
    matching.map(|estimate| estimate.value)
}
