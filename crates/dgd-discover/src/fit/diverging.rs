//! A structure whose simulations end before the recordings do.

use std::sync::OnceLock;

use dgd_identify::{ParameterEstimate, Recording};
use dgd_runtime::{Direction, Observations, Problem, System, observe, simulate};

use super::data::SearchData;
use super::fitted::{FittedStructure, NoFit};
use crate::library::{CarriedValues, ModelStructure};

/// Largest distance of an output from the readings' mean, in their spreads; how much further a simulation diverges does
/// not matter.
const FARTHEST: f64 = 1e3;

impl FittedStructure {
    /// A structure with the model's own values, simulated as far as it can be; from there on the last values are held.
    /// Nothing is fitted.
    ///
    /// # Errors
    ///
    /// [`NoFit`] if a recording cannot be begun.
    pub(crate) fn diverging(
        structure: ModelStructure,
        data: &SearchData<'_>,
    ) -> Result<FittedStructure, NoFit> {
        let system = &structure.system;
        let p = CarriedValues::default().parameters(system);
        let train: Vec<Observations> = (data.train.iter())
            .map(|recording| as_far_as_possible(&structure, &p, recording, data))
            .collect::<Result<_, _>>()?;
        let signature = system.signature();
        let directions = signature.directions.iter().enumerate();
        let parameters = directions.filter_map(|(j, direction)| match direction {
            Direction::Parameter(i) => {
                Some((signature.direction_name(j).into_owned(), *i, *direction))
            }
            Direction::Start(_) => None,
        });
        let estimates = parameters.map(|(name, i, of)| ParameterEstimate {
            name,
            of,
            recording: None,
            value: p[i],
            std: None,
            at_bound: None,
        });
        let estimates = estimates.collect();
        let starts = vec![Vec::new(); data.train.len()];
        let mut fitted = FittedStructure {
            values: CarriedValues::collect(system, &p, &starts),
            structure,
            p,
            estimates,
            moments: Vec::new(),
            is_converged: false,
            is_cut_short: false,
            error: (0.0, 0),
            train,
            valid: None,
            cancelling: OnceLock::new(),
            foreseen: OnceLock::new(),
        };
        fitted.weigh(data);
        Ok(fitted)
    }
}

fn as_far_as_possible(
    structure: &ModelStructure,
    p: &[f64],
    recording: &Recording,
    data: &SearchData<'_>,
) -> Result<Observations, NoFit> {
    let Recording { inputs, times, measured, start, .. } = recording;
    let problem = Problem { system: &structure.system, p, inputs, start };
    let options = data.options_for(&structure.system);
    let (solution, why) = match simulate(&problem, times, &options) {
        Ok(solution) => (solution, None),
        Err(failure) => (*failure.partial, Some(failure.error)),
    };
    if solution.times.is_empty() {
        return Err(NoFit::NotSimulated(why));
    }
    let mut simulated = observe(&problem, &solution);
    let n_w = simulated.n_w;
    while simulated.w.len() < n_w * times.len() {
        simulated.w.push(simulated.w[simulated.w.len() - n_w]);
    }
    for (output, read) in measured.iter().enumerate() {
        let Some(read) = read else { continue };
        let finite = || read.iter().copied().filter(|x| x.is_finite());
        let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
        let spread = finite().map(|x| (x - mean).abs()).fold(0.0, f64::max);
        for w in simulated.w.iter_mut().skip(output).step_by(n_w) {
            let off = if w.is_finite() { *w - mean } else { spread };
            *w = mean + off.clamp(-FARTHEST * spread, FARTHEST * spread);
        }
    }
    Ok(simulated)
}
