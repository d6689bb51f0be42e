//! Repeats the user's run with a slightly changed parameter or initial value.

use dgd_runtime::{Direction, Failure, Interpolation, Options, Problem, observe, simulate};

use super::VerifiedTrajectory;
use super::extrapolate::DifferenceQuotient;
use crate::error::{ComputationError, WorkError};
use crate::run::ModelRun;

/// The largest change, as a fraction of the parameter's size, halved three times: with relative errors of 1e-10 in the
/// runs, the differences are accurate to about 1e-7 of the quantity.
const CHANGE: f64 = 4e-3;

/// Runs at decreasing changes.
pub(super) struct MovedRuns {
    /// Largest change first.
    rungs: Vec<RunPair>,
    /// The unchanged run, if the others lie on both sides of it.
    unmoved: Option<VerifiedTrajectory>,
    /// The error of a quotient is a power series in the change to this power.
    pub(super) order: i32,
}

/// Two runs, at one change.
struct RunPair {
    /// The parameter in the second run minus that in the first.
    change: f64,
    first: VerifiedTrajectory,
    second: VerifiedTrajectory,
    /// Whether both runs match the user's at a sample: same modes, same number of events, same segments of piecewise
    /// inputs.
    alike: Vec<bool>,
}

impl MovedRuns {
    /// Difference quotients of `value` at the k-th sample, for those of the smaller changes without an event or jump in
    /// between.
    ///
    /// `noise` is the error of a simulation.
    pub(super) fn quotients(
        &self,
        k: usize,
        noise: f64,
        value: impl Fn(&VerifiedTrajectory) -> f64,
    ) -> Vec<DifferenceQuotient> {
        let quotient = |rung: &RunPair| {
            let difference = value(&rung.second) - value(&rung.first);
            DifferenceQuotient { value: difference / rung.change, noise: noise / rung.change }
        };
        self.alike(k).map(quotient).collect()
    }

    /// The same for each side by itself, lower and higher; `None` if the parameter was moved to one side only.
    pub(super) fn one_sided(
        &self,
        k: usize,
        noise: f64,
        value: impl Fn(&VerifiedTrajectory) -> f64,
    ) -> Option<[Vec<DifferenceQuotient>; 2]> {
        let unmoved = value(self.unmoved.as_ref()?);
        let side = |rung: &RunPair, difference: f64| {
            let change = 0.5 * rung.change;
            DifferenceQuotient { value: difference / change, noise: noise / change }
        };
        let lower = self.alike(k).map(|rung| side(rung, unmoved - value(&rung.first)));
        let higher = self.alike(k).map(|rung| side(rung, value(&rung.second) - unmoved));
        Some([lower.collect(), higher.collect()])
    }

    /// The changes without an event or jump in between at the k-th sample.
    fn alike(&self, k: usize) -> impl Iterator<Item = &RunPair> {
        let is_other = move |rung: &&RunPair| rung.alike.get(k) != Some(&true);
        self.rungs.iter().skip_while(is_other)
    }
}

/// Samples before sensitivities become undefined for good. A changed run may stop there, and later samples are not
/// compared.
fn defined(given: &VerifiedTrajectory) -> usize {
    let solution = &given.solution;
    let is_known = |k: &usize| !solution.s(*k).iter().any(|s| s.is_nan());
    (0..solution.len()).take_while(is_known).count()
}

/// Repeats the run with the parameter lower and higher, or only higher if lower is impossible.
pub(super) fn moved(
    run: &ModelRun,
    given: &VerifiedTrajectory,
    direction: Direction,
    size: f64,
    options: &Options,
) -> Result<MovedRuns, WorkError> {
    let times = &run.times[..defined(given)];
    if times.is_empty() {
        return Ok(MovedRuns { rungs: Vec::new(), unmoved: None, order: 1 });
    }
    let lowest = match direction {
        Direction::Parameter(i) => run.signature().parameters[i].lower,
        Direction::Start(_) => f64::NEG_INFINITY,
    };
    let value = match direction {
        Direction::Parameter(i) => run.p[i],
        Direction::Start(i) => given.solution.y(0)[i],
    };
    let changes = [1.0, 0.5, 0.25, 0.125].map(|part| CHANGE * size * part);
    let expected = BranchStates::collect(run, &run.p, given)?;
    let trajectory = |change: f64| trajectory(run, times, direction, value + change, options);

    if value - CHANGE * size >= lowest
        && let Ok(rungs) = changes
            .iter()
            .map(|&h| Ok((2.0 * h, trajectory(-h)?, trajectory(h)?)))
            .collect::<Result<Vec<_>, WorkError>>()
    {
        let unmoved = trajectory(0.0).ok().map(|(unmoved, _)| unmoved);
        return Ok(MovedRuns { rungs: compared(rungs, &expected), unmoved, order: 2 });
    }
    let unmoved = trajectory(0.0)?;
    let mut rungs = Vec::with_capacity(changes.len());
    for h in changes {
        rungs.push((h, unmoved.clone(), trajectory(h)?));
    }
    Ok(MovedRuns { rungs: compared(rungs, &expected), unmoved: None, order: 1 })
}

type WithBranches = (VerifiedTrajectory, BranchStates);

fn compared(
    rungs: Vec<(f64, WithBranches, WithBranches)>,
    expected: &BranchStates,
) -> Vec<RunPair> {
    let rung = |(change, (first, a), (second, b)): (f64, WithBranches, WithBranches)| {
        let branches = expected.0.iter().zip(&a.0).zip(&b.0);
        let alike = branches.map(|((expected, a), b)| expected == a && expected == b).collect();
        RunPair { change, first, second, alike }
    };
    rungs.into_iter().map(rung).collect()
}

/// The run with another value of one parameter or initial value.
fn trajectory(
    run: &ModelRun,
    times: &[f64],
    direction: Direction,
    value: f64,
    options: &Options,
) -> Result<WithBranches, WorkError> {
    let (mut p, mut start) = (run.p.clone(), run.start.clone());
    let name = match direction {
        Direction::Parameter(i) => {
            p[i] = value;
            run.signature().parameters[i].name.to_string()
        }
        Direction::Start(i) => {
            start.retain(|(unknown, _)| *unknown != i);
            start.push((i, value));
            run.signature().unknowns.name(i).to_string()
        }
    };
    let problem = Problem { p: &p, start: &start, ..run.problem() };
    let solution = simulate(&problem, times, options).map_err(|Failure { error, .. }| {
        ComputationError::Verification { name: name.clone(), value, error }
    })?;
    let observations = observe(&problem, &solution);
    let trajectory = VerifiedTrajectory { solution, observations };
    let branches = BranchStates::collect(run, &p, &trajectory)?;
    Ok((trajectory, branches))
}

/// State that must be equal at a sample of two runs for their difference to be one of smooth functions.
#[derive(Clone)]
struct BranchStates(Vec<BranchState>);

#[derive(Clone, PartialEq)]
struct BranchState {
    /// Modes and conditions on time, at the sample and at its delayed times.
    z: Vec<f64>,
    /// Number of events up to each of these times.
    events: Vec<usize>,
    /// Input segments read by delayed outputs.
    segments: Vec<usize>,
    /// Delayed held inputs, and slopes of delayed linear ones.
    late_inputs: Vec<f64>,
}

impl BranchStates {
    fn collect(
        run: &ModelRun,
        p: &[f64],
        of: &VerifiedTrajectory,
    ) -> Result<BranchStates, WorkError> {
        let problem = Problem { p, ..run.problem() };
        let read = problem.inputs_read();
        let read = read.map_err(ComputationError::Inputs)?;
        let mut u = vec![0.0; read.len()];
        let solution = &of.solution;
        let events = |t: f64| solution.events.partition_point(|event| event.t <= t);
        let branch = |k: usize| {
            let (t, side) = (solution.times[k], solution.side(k));
            read.value(t, side, &mut u);
            let mut branch = BranchState {
                z: solution.z(k).to_vec(),
                events: vec![events(t)],
                segments: Vec::new(),
                late_inputs: delayed_inputs(run, &u),
            };
            for late in &solution.delayed_outputs {
                let n_z = solution.n_z;
                branch.z.extend_from_slice(&late.z[k * n_z..(k + 1) * n_z]);
                branch.events.push(events(late.times[k]));
                branch.segments.push(run.inputs.segment_at(late.times[k], side));
            }
            branch
        };
        Ok(BranchStates((0..solution.len()).map(branch).collect()))
    }
}

/// Delayed inputs of the model: the values of held ones, and the slopes of all.
fn delayed_inputs(run: &ModelRun, u: &[f64]) -> Vec<f64> {
    let signature = run.signature();
    let (n, n_late) = (signature.inputs.len(), signature.delayed_inputs.len());
    let held_inputs = signature
        .delayed_inputs
        .iter()
        .enumerate()
        .filter(|(_, late)| signature.inputs[late.input].interpolation == Interpolation::Hold);
    held_inputs.map(|(i, _)| u[n + i]).chain(u[n + n_late..].iter().copied()).collect()
}
