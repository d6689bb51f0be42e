//! Preparations of a search from the readings alone: the accuracy of its simulations, and a starting point from which
//! the likelihood of noise that grows with the output converges to its minimum.
//!
//! ```text
//!   atol ≤ max(rtol |y|, σ(y)/100)/Σ |∂w/∂x| size(x)     over all readings y
//! ```
//!
//! σ(y) is the noise of the reading: declared, recorded, or from the formula with its shape in the first run
//! ([`NoiseShape`]); if σ grows with the output, the outputs of that run count as readings, too: σ of an output that is
//! lost in the tolerance may be negative. So the tolerance is fixed once for all simulations of a fit, and a species
//! that falls through decades is resolved as far down as it was measured. It is never looser than that of the problem.
//!
//! If σ grows with the output, the search first minimises the likelihood in the scale in which noise is uniform, with
//! the shape of σ at the starting point, and repeats this with the updated shape as long as −2 ln of the likelihood
//! itself decreases. Then it continues with the likelihood itself.

use dgd_runtime::for_identify::unknown_sizes;
use dgd_runtime::signature::{Density, Distribution};
use dgd_runtime::{EvaluationPoint, LimitSide, Options, Problem, consistent_start};

use super::fit::FitTotals;
use super::stepping::SteppingAccuracy;
use super::{EstimationEnd, OutputErrorProblem, Starts, estimate, evaluate};
use crate::error::EstimateError;
use crate::journal::Digest;
use crate::noise::NoiseSource;
use crate::noise::density::PredictedReading;
use crate::noise::shape::NoiseShape;
use crate::output_error::OutputErrorEvaluation;
use crate::recording::Recording;
use crate::variables::FitVariables;

/// Largest simulation error, relative to the noise of a reading.
const OF_NOISE: f64 = 0.01;

/// Limit on searches in a scale in which noise is uniform.
const MOST_SHAPES: usize = 3;

/// [`OutputErrorProblem::negligible_reduction`] of the first search: a tenth of a standard deviation.
const NEARBY: f64 = 1e-2;

/// A point of the search, simulated without derivatives.
struct SimulatedPoint<'p, 'a> {
    problem: &'p OutputErrorProblem<'a>,
    found: OutputErrorEvaluation,
}

impl<'p, 'a> SimulatedPoint<'p, 'a> {
    /// `None` if it cannot be simulated.
    fn new(
        problem: &'p OutputErrorProblem<'a>,
        variables: &FitVariables,
        z: &[f64],
        total: &mut FitTotals,
    ) -> Option<Self> {
        let p = variables.parameters(problem.p, z);
        let recordings = problem.recordings.iter().enumerate();
        let starts: Vec<Starts> =
            recordings.map(|(r, recording)| variables.starts(r, &recording.start, z)).collect();
        // If this is cancelled, so is the search.
        let evaluation = evaluate(problem, &p, &starts).ok()?;
        total.beforehand += 1;
        Some(Self { problem, found: evaluation })
    }

    /// For the counted samples of an output: the reading, and all outputs.
    fn samples(&self, output: usize) -> impl Iterator<Item = (f64, &[f64])> + '_ {
        let recordings = self.problem.recordings.iter().zip(&self.found.observations);
        recordings.flat_map(move |(recording, observations)| {
            recording.counted(output).map(move |(k, y)| (y, observations.w(k)))
        })
    }

    /// The growth of an output's noise with the output, if any.
    fn shape(&self, output: usize) -> Option<NoiseShape> {
        let Some(NoiseSource::Density(density)) = self.problem.noise[output] else { return None };
        if density.distribution == Distribution::LogNormal {
            return None;
        }
        let pairs = self.samples(output).map(|(_, w)| (w[output], w[density.deviation]));
        let measured: Vec<f64> = self.samples(output).map(|(y, _)| y).collect();
        NoiseShape::fit(&pairs.collect::<Vec<_>>(), &measured)
    }

    /// −2 ln of the likelihood of the outputs whose readings have individual σ; `None` if a reading has none.
    fn deviance(&self) -> Option<f64> {
        let mut sum = 0.0;
        for (output, noise) in self.problem.noise.iter().enumerate() {
            let Some(NoiseSource::Density(density)) = noise else { continue };
            for (measured, w) in self.samples(output) {
                let sigma = w[density.deviation];
                let reading = PredictedReading { measured, simulated: w[output], sigma };
                if reading.spoilt(density.distribution).is_some() {
                    return None;
                }
                let term = reading.term(density.distribution);
                sum += term.cost + term.logarithm;
            }
        }
        Some(sum)
    }
}

/// The readings of an output, each with its noise; empty if the noise is unknown. `evaluate` is needed for computed
/// noise; if that grows with the output, the outputs `simulated` there follow.
fn noise_of_readings(
    problem: &OutputErrorProblem<'_>,
    at: Option<&SimulatedPoint<'_, '_>>,
    output: usize,
    simulated: bool,
) -> Vec<(f64, f64)> {
    let declared = problem.system.signature().outputs[output].noise;
    let is_usable = |(_, sigma): &(f64, f64)| *sigma > 0.0 && sigma.is_finite();
    let (Some(NoiseSource::Density(density)), Some(at)) = (problem.noise[output], at) else {
        let of_recording = |recording: &Recording| -> Vec<(f64, f64)> {
            let sigma = |k: usize| match problem.noise[output]? {
                NoiseSource::Known(sigma) => Some(sigma),
                NoiseSource::Estimated => declared,
                NoiseSource::Recorded => Some(recording.deviations_of(output)?[k]),
                NoiseSource::Density(_) | NoiseSource::Stabilised(..) => None,
            };
            recording.counted(output).filter_map(|(k, y)| Some((y, sigma(k)?))).collect()
        };
        return problem.recordings.iter().flat_map(of_recording).filter(is_usable).collect();
    };
    let shape = at.shape(output);
    let noise_at = |(y, w): (f64, &[f64])| {
        let sigma = w[density.deviation].abs();
        let sigma = match (density.distribution, shape) {
            (Distribution::LogNormal, _) => sigma * y,
            (_, Some(shape)) => sigma * shape.evaluate(y) / shape.evaluate(w[output]),
            (_, None) => sigma,
        };
        (y, sigma)
    };
    let simulated = at.samples(output).filter(|_| simulated && shape.is_some());
    let simulated = simulated.map(|(_, w)| (w[output], w[density.deviation].abs()));
    at.samples(output).map(noise_at).chain(simulated).filter(is_usable).collect()
}

/// Whether the model computes the noise of an output.
fn is_computed(problem: &OutputErrorProblem<'_>) -> bool {
    problem.noise.iter().any(|noise| matches!(noise, Some(NoiseSource::Density(_))))
}

/// The problem with the absolute tolerance that its readings need, or a looser one if it cannot be simulated with that.
pub(super) fn with_tolerance<'a>(
    problem: &OutputErrorProblem<'a>,
    variables: &FitVariables,
    z: &[f64],
    total: &mut FitTotals,
) -> OutputErrorProblem<'a> {
    let Some(reaches) = reaches(problem, variables, z) else { return problem.clone() };
    let first_run =
        if is_computed(problem) { SimulatedPoint::new(problem, variables, z, total) } else { None };
    let with = |atol: f64| {
        let options = Options { atol: problem.options.atol.min(atol), ..problem.options };
        OutputErrorProblem { options, ..problem.clone() }
    };
    for simulated in [true, false] {
        let atol = (0..reaches.len()).filter(|output| reaches[*output] > 0.0).map(|output| {
            let readings =
                noise_of_readings(problem, first_run.as_ref(), output, simulated).into_iter();
            let least =
                readings.map(|(y, sigma)| (problem.options.rtol * y.abs()).max(OF_NOISE * sigma));
            least.fold(f64::INFINITY, f64::min) / reaches[output]
        });
        let atol = atol.filter(|atol| *atol > 0.0).fold(f64::INFINITY, f64::min);
        if atol >= problem.options.atol {
            break;
        }
        let tighter = with(atol);
        if SimulatedPoint::new(&tighter, variables, z, total).is_some() {
            return tighter;
        }
    }
    with(f64::INFINITY)
}

/// Σ |∂w/∂x| size(x) of each output at the start of the first recording; `None` for a model without unknowns.
fn reaches(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
) -> Option<Vec<f64>> {
    let (system, signature) = (problem.system, problem.system.signature());
    let recording = problem.recordings.first().filter(|_| !signature.unknowns.is_empty())?;
    let t = *recording.times.first()?;
    let p = variables.parameters(problem.p, z);
    let start = variables.starts(0, &recording.start, z);
    let run = Problem { system: &system, p: &p, inputs: &recording.inputs, start: &start };
    let consistent = consistent_start(&run, t, &problem.options).ok()?;
    let mut sizes = vec![0.0; consistent.y.len()];
    unknown_sizes(&system, &consistent.y, &mut sizes);
    // Delayed unknowns follow the inputs in u; sizes hardly depend on them.
    let mut u = vec![0.0; signature.n_u()];
    recording.inputs.value(t, LimitSide::Right, &mut u[..recording.inputs.len()]);
    let n_w = signature.outputs.len();
    let [by_y, by_u, by_p] = &signature.output_jacobians;
    let mut dwdy = vec![0.0; by_y.len()];
    let (mut dwdu, mut dwdp) = (vec![0.0; by_u.len()], vec![0.0; by_p.len()]);
    let point = EvaluationPoint { t, y: &consistent.y, u: &u, p: &p, z: &consistent.z };
    system.output_jacobians(point, &mut dwdy, &mut dwdu, &mut dwdp, &mut vec![0.0; n_w]);
    let mut reaches = vec![0.0; n_w];
    for ((row, column), value) in by_y.positions().zip(&dwdy) {
        reaches[row] += value.abs() * sizes[column];
    }
    Some(reaches)
}

/// A point closer to the minimum of a likelihood whose noise grows with the outputs; z itself if none does.
pub(super) fn closer(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: Vec<f64>,
    data: usize,
    of: Option<Digest>,
    total: &mut FitTotals,
) -> Result<Vec<f64>, EstimateError> {
    if !is_computed(problem) {
        return Ok(z);
    }
    let Some(mut at) = SimulatedPoint::new(problem, variables, &z, total) else { return Ok(z) };
    let mut z = z;
    for round in 0..MOST_SHAPES {
        let shapes: Vec<Option<NoiseShape>> =
            (0..problem.noise.len()).map(|i| at.shape(i)).collect();
        if shapes.iter().all(Option::is_none) {
            break;
        }
        let even =
            |(noise, shape): (&Option<NoiseSource>, &Option<NoiseShape>)| match (noise, shape) {
                (Some(NoiseSource::Density(density)), Some(shape)) => {
                    // Far away the slopes of Student's density vanish, but not those of the normal one.
                    let normal = Density { distribution: Distribution::Normal, ..*density };
                    Some(NoiseSource::Stabilised(normal, *shape))
                }
                (noise, _) => *noise,
            };
        let noise = problem.noise.iter().zip(&shapes).map(even).collect();
        let mut stopping = problem.stopping;
        // Half of the remaining evaluations are for the likelihood itself.
        let left = stopping.evaluations.saturating_sub(total.evaluations);
        stopping.evaluations = total.evaluations + left / 2;
        let scaled =
            OutputErrorProblem { noise, stopping, negligible_reduction: NEARBY, ..problem.clone() };
        let accuracy = SteppingAccuracy::first(&scaled, variables, &z)?;
        let scaled = OutputErrorProblem { options: accuracy.applied(), ..scaled };
        let pairs = shapes.iter().flatten().map(|shape| (shape.floor, shape.slope));
        let digest =
            of.map(|of| of.debug(&("even noise", round)).debug(&pairs.collect::<Vec<_>>()));
        let ended = estimate(&scaled, variables, z.clone(), data, digest, total);
        let Ok(EstimationEnd { z: found, .. }) = ended else { break };
        let Some(next) = SimulatedPoint::new(problem, variables, &found, total) else { break };
        let Some(deviance) = next.deviance() else { break };
        if at.deviance().is_some_and(|before| before <= deviance) {
            break;
        }
        (z, at) = (found, next);
    }
    Ok(z)
}
