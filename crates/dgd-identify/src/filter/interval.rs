//! The model over one interval, and its derivatives at one time.
//!
//! A run over one interval starts with all unknowns given, algebraic ones as guesses, in the final modes of the
//! previous run. A run of zero length makes them consistent and gives S = ∂y/∂(x, θ) there; with it the generated
//! functions give
//!
//! ```text
//!   A = ∂ẋ/∂(x, θ) = rows of x of (∂f/∂y S + ∂f/∂θ),    C = dw/d(x, θ) = ∂w/∂y S + ∂w/∂θ
//! ```
//!
//! Derivatives with respect to past values ([`EstimateHistory`]) come from further runs, in which the past has these
//! sensitivities.

use dgd_runtime::for_identify::{PastSolution, delays, held_by_bounds};
use dgd_runtime::integrate::RunMemory;
use dgd_runtime::model::{Model, ModelProblem, observe};
use dgd_runtime::{
    Direction, EvaluationPoint, Inputs, IntegrateError, LimitSide, Options, PriorState, Problem,
    Solution, WantedResults,
};
use nalgebra::DMatrix;

use super::coordinates::FilterCoordinates;
use super::delayed_outputs::DelayedOutputModel;
use super::error::FilterError;
use super::problem::FilterProblem;
use super::remembered::EstimateHistory;
use super::square_root::beside;
use crate::error::TrialFailure;

/// A model, as needed by a filter.
pub(super) struct IntervalModel<'a> {
    pub system: &'a dyn Model,
    pub p: &'a [f64],
    pub options: Options,
    /// Whether all unknowns are differential, and there are no events and no delays.
    is_plain: bool,
    /// Delayed unknowns, ascending.
    watched: Vec<usize>,
    delayed_outputs: DelayedOutputModel,
}

/// The state at the start or at the end of a run.
#[derive(Debug, Clone)]
pub(super) struct RunState {
    /// Unknowns: guesses of the algebraic ones.
    pub y: Vec<f64>,
    /// Modes, and the rest of the memory of the previous run.
    pub memory: Option<RunMemory>,
    /// Past values, if they are read.
    pub past: Option<EstimateHistory>,
}

impl RunState {
    /// The state from which a run continues.
    fn before<'a>(&'a self, past: Option<&'a PastSolution>) -> PriorState<'a> {
        let own_past = || self.past.as_ref().map(EstimateHistory::past);
        PriorState { memory: self.memory.as_ref(), past: past.or_else(own_past) }
    }

    /// The same state with a perturbed past.
    pub(super) fn moved_by(&self, steps: &[f64]) -> Self {
        let mut place = self.clone();
        if let Some(past) = &mut place.past {
            past.correct(steps);
        }
        place
    }
}

/// An interval of time.
#[derive(Clone, Copy)]
pub(super) struct TimeInterval {
    pub from: f64,
    pub until: f64,
}

impl TimeInterval {
    /// Its length.
    pub(super) fn length(self) -> f64 {
        self.until - self.from
    }
}

/// The state at the end of an interval.
pub(super) struct IntervalEnd {
    pub place: RunState,
    /// ∂x/∂(x, θ, past) in scaled variables: states × all, the past before the interval.
    pub phi: DMatrix<f64>,
}

/// Unknowns at one time and their sensitivities.
enum ConsistentUnknowns {
    /// If all unknowns are states, they are consistent as given.
    AsGiven { y: Vec<f64>, s: Vec<f64> },
    /// From a run of zero length.
    Run(Box<Solution>),
}

impl ConsistentUnknowns {
    /// y, S and z.
    fn parts(&self) -> (&[f64], &[f64], &[f64]) {
        match self {
            ConsistentUnknowns::AsGiven { y, s } => (y, s, &[]),
            ConsistentUnknowns::Run(run) => (run.y(0), run.s(0), run.z(0)),
        }
    }
}

/// The model near one time.
pub(super) struct LocalModel {
    /// Unknowns, consistent.
    pub y: Vec<f64>,
    /// Outputs.
    pub w: Vec<f64>,
    /// ∂x/∂(x, θ, past) in scaled variables: states × all. Rows of states that are algebraic here contain their
    /// dependence on the others.
    pub phi: DMatrix<f64>,
    /// A in scaled variables: states × states and parameters.
    pub a: DMatrix<f64>,
    /// C in scaled variables: outputs, SI, × all.
    pub c: DMatrix<f64>,
    /// C of the delayed unknowns, SI.
    pub watched: DMatrix<f64>,
}

/// Results of the generated functions at a point, with the directions of a run.
struct PointFunctions {
    run: ConsistentUnknowns,
    /// ∂f/∂θ along the directions.
    g: Vec<f64>,
    w: Vec<f64>,
    dw: Vec<f64>,
}

impl<'a> IntervalModel<'a> {
    /// # Errors
    ///
    /// [`FilterError::NotFollowed`] for unsupported delays.
    pub(super) fn new(problem: &FilterProblem<'a>) -> Result<Self, FilterError> {
        let FilterProblem { system, p, options, .. } = *problem;
        let signature = system.signature();
        if let Some(delayed) = signature.delayed_unknowns.iter().find(|delayed| delayed.varies) {
            let name = signature.unknowns.name(delayed.unknown);
            let what = format!("what `{name}` was, at a delay that varies");
            return Err(FilterError::NotFollowed { what });
        }
        let delayed_outputs = DelayedOutputModel::new(system, p)?;
        let is_differential = |i: usize| signature.unknowns.is_differential(i);
        let is_plain = signature.discrete.is_empty()
            && signature.delayed_unknowns.is_empty()
            && (0..signature.unknowns.len()).all(is_differential);
        let delayed = signature.delayed_unknowns.iter().map(|delayed| delayed.unknown);
        let mut watched: Vec<usize> = delayed.chain(delayed_outputs.unknowns()).collect();
        watched.sort_unstable();
        watched.dedup();
        Ok(Self { system, p, options, is_plain, watched, delayed_outputs })
    }

    /// Delayed unknowns, ascending.
    pub(super) fn watched(&self) -> &[usize] {
        &self.watched
    }

    /// The longest delay, s.
    pub(super) fn reach(&self, p: &[f64]) -> f64 {
        let inputs = Inputs::none();
        let problem = Problem { system: &self.system, p, inputs: &inputs, start: &[] };
        delays(&problem).into_iter().filter(|tau| tau.is_finite()).fold(0.0, f64::max)
    }

    /// Moves the unknowns from one time to another, with sensitivities.
    pub(super) fn move_with_sensitivities(
        &self,
        inputs: &Inputs,
        over: TimeInterval,
        from: &RunState,
        coordinates: &FilterCoordinates,
        variables: &[f64],
    ) -> Result<IntervalEnd, TrialFailure> {
        let (p, start) = self.started(&from.y, coordinates, variables);
        let problem = Problem { system: &self.system, p: &p, inputs, start: &start };
        let wanted = WantedResults::ResumedSensitivities(from.before(None));
        let mut solution = self.run_over(&problem, from, over, wanted)?;
        let last = solution.len() - 1;
        let mut phi = transition(solution.s(last), solution.n, coordinates, variables);
        if let Some(past) = &from.past {
            let [s_past] = self.by_past(past, &p, over, [solution.s(last)], |seeded| {
                let wanted = WantedResults::ResumedSensitivities(from.before(Some(seeded)));
                let run = self.run(&problem, &[over.from, over.until], wanted)?;
                Ok([run.s(run.len() - 1).to_vec()])
            })?;
            phi = beside(&phi, &rows_of_states(&s_past, coordinates));
        }
        if phi.iter().all(|value| value.is_finite()) {
            Ok(IntervalEnd { place: ended(from, &mut solution), phi })
        } else {
            Err(self.undefined(over.until, &solution))
        }
    }

    /// Moves the unknowns from one time to another.
    pub(super) fn move_states(
        &self,
        inputs: &Inputs,
        over: TimeInterval,
        from: &RunState,
        coordinates: &FilterCoordinates,
        variables: &[f64],
    ) -> Result<RunState, TrialFailure> {
        let (p, start) = self.started(&from.y, coordinates, variables);
        let problem = Problem { system: &self.system, p: &p, inputs, start: &start };
        let wanted = WantedResults::Resumed(from.before(None));
        let mut solution = self.run_over(&problem, from, over, wanted)?;
        Ok(ended(from, &mut solution))
    }

    /// Outputs at one time, for one set of states and parameters.
    pub(super) fn outputs(
        &self,
        inputs: &Inputs,
        t: f64,
        at: &RunState,
        coordinates: &FilterCoordinates,
        variables: &[f64],
    ) -> Result<Vec<f64>, TrialFailure> {
        let (p, start) = self.started(&at.y, coordinates, variables);
        let problem = Problem { system: &self.system, p: &p, inputs, start: &start };
        let solution = self.run(&problem, &[t], WantedResults::Resumed(at.before(None)))?;
        let mut w = observe(&problem, &solution).w;
        if let Some(past) = &at.past {
            let here = EvaluationPoint { t, y: solution.y(0), u: &[], p: &p, z: solution.z(0) };
            self.delayed_outputs.read(&problem, here, past)?.write(&mut w);
        }
        Ok(w)
    }

    /// The model near one time.
    pub(super) fn local(
        &self,
        inputs: &Inputs,
        t: f64,
        at: &RunState,
        coordinates: &FilterCoordinates,
        variables: &[f64],
    ) -> Result<LocalModel, TrialFailure> {
        let (p, start) = self.started(&at.y, coordinates, variables);
        let problem = Problem { system: &self.system, p: &p, inputs, start: &start };
        let PointFunctions { run, g, mut w, dw } = self.look(&problem, t, at, None)?;
        let (y, s, z) = run.parts();

        let (n, n_w) = (y.len(), w.len());
        let slope = |column: usize| coordinates.slope(column, variables[column]);
        let mut c = DMatrix::from_fn(n_w, coordinates.len(), |row, column| {
            dw[coordinates.directions[column] * n_w + row] * slope(column)
        });
        let mut phi = transition(s, n, coordinates, variables);
        let mut watched = DMatrix::from_fn(self.watched.len(), coordinates.len(), |row, column| {
            s[coordinates.directions[column] * n + self.watched[row]] * slope(column)
        });
        if let Some(past) = &at.past {
            let [s_past, c_past] =
                self.by_past(past, &p, TimeInterval { from: t, until: t }, [s, &dw], |seeded| {
                    let with = self.look(&problem, t, at, Some(seeded))?;
                    Ok([with.run.parts().1.to_vec(), with.dw])
                })?;
            phi = beside(&phi, &rows_of_states(&s_past, coordinates));
            watched = beside(&watched, &s_past.select_rows(&self.watched));
            c = beside(&c, &c_past);
            let here = EvaluationPoint { t, y, u: &[], p: &p, z };
            let outputs = self.delayed_outputs.read(&problem, here, past)?;
            outputs.write(&mut w);
            outputs.differentiate(coordinates, variables, &mut c);
        }
        let a = transition(&g, n, coordinates, variables);
        Ok(LocalModel { y: y.to_vec(), w, phi, a, c, watched })
    }

    /// Evaluates the model at one time, optionally with a past that has sensitivities instead of its own one.
    fn look(
        &self,
        problem: &ModelProblem<'_>,
        t: f64,
        at: &RunState,
        past: Option<&PastSolution>,
    ) -> Result<PointFunctions, TrialFailure> {
        let run = self.consistent(problem, t, at, past)?;
        let (y, s, z) = run.parts();
        let signature = self.system.signature();
        let mut u = vec![0.0; signature.n_u()];
        let read = problem.inputs_read();
        let read = read.map_err(|error| TrialFailure::Simulation(IntegrateError::Inputs(error)))?;
        read.value(t, LimitSide::Right, &mut u);
        if let ConsistentUnknowns::Run(run) = &run {
            let first = u.len() - run.n_past;
            u[first..].copy_from_slice(run.past(0));
        }
        let point = EvaluationPoint { t, y, u: &u, p: problem.p, z };
        let (mut f, mut g) = (vec![0.0; y.len()], vec![0.0; s.len()]);
        self.system.sensitivity_rhs(point, s, &mut f, &mut g);
        let n_w = signature.outputs.len();
        let (mut w, mut dw) = (vec![0.0; n_w], vec![0.0; n_w * signature.directions.len()]);
        self.system.output_sensitivities(point, s, &mut w, &mut dw);
        Ok(PointFunctions { run, g, w, dw })
    }

    /// The delayed unknowns in the equations: positions among the remembered unknowns, and delays.
    fn delays(&self, p: &[f64]) -> Vec<(usize, f64)> {
        let signature = self.system.signature();
        let inputs = Inputs::none();
        let tau = delays(&Problem { system: &self.system, p, inputs: &inputs, start: &[] });
        let read = signature.delayed_unknowns.iter().filter_map(|delayed| {
            let unknown = self.watched.iter().position(|i| *i == delayed.unknown)?;
            Some((unknown, tau[delayed.delay]))
        });
        read.collect()
    }

    /// Derivatives of the results of a run with respect to the variables of the past, SI: rows × past, for each array
    /// of results by directions. `without` are the results with the past as it is, `with` those with a past whose first
    /// directions also represent some of the variables.
    fn by_past<const N: usize>(
        &self,
        past: &EstimateHistory,
        p: &[f64],
        over: TimeInterval,
        without: [&[f64]; N],
        with: impl Fn(&PastSolution) -> Result<[Vec<f64>; N], TrialFailure>,
    ) -> Result<[DMatrix<f64>; N], TrialFailure> {
        let directions = self.system.signature().directions.len().max(1);
        let mut derivatives = without.map(|of| DMatrix::zeros(of.len() / directions, past.len()));
        for some in self.read_delayed(past, p, over) {
            let with = with(&past.seeded(&some))?;
            for (j, variable) in some.into_iter().enumerate() {
                let size = past.sizes()[variable % past.sizes().len()];
                for ((columns, with), without) in derivatives.iter_mut().zip(&with).zip(without) {
                    let offset = j * columns.nrows();
                    for (row, derivative) in columns.column_mut(variable).iter_mut().enumerate() {
                        *derivative = (with[offset + row] - without[offset + row]) * size;
                    }
                }
            }
        }
        Ok(derivatives)
    }

    /// Variables of the past that the equations read between two times, in groups of at most the number of directions.
    fn read_delayed(
        &self,
        past: &EstimateHistory,
        p: &[f64],
        over: TimeInterval,
    ) -> Vec<Vec<usize>> {
        let variables = past.read_between(&self.delays(p), over);
        let at_once = self.system.signature().directions.len().max(1);
        variables.chunks(at_once).map(<[usize]>::to_vec).collect()
    }

    /// A run over an interval, with all values of it that are to be remembered.
    fn run_over(
        &self,
        problem: &ModelProblem<'_>,
        from: &RunState,
        over: TimeInterval,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, TrialFailure> {
        let Some(past) = &from.past else {
            return self.run(problem, &[over.from, over.until], wanted);
        };
        let delays = self.delays(problem.p);
        let run = self.run(problem, &past.asked(&delays, &[], over), wanted)?;
        if run.events.is_empty() {
            return Ok(run);
        }
        // Values that jump at events are stored on both sides of these.
        self.run(problem, &past.asked(&delays, &run.events, over), wanted)
    }

    /// Unknowns that satisfy the equations, and their dependence on states and parameters.
    fn consistent(
        &self,
        problem: &ModelProblem<'_>,
        t: f64,
        at: &RunState,
        past: Option<&PastSolution>,
    ) -> Result<ConsistentUnknowns, TrialFailure> {
        if !self.is_plain {
            let wanted = WantedResults::ResumedSensitivities(at.before(past));
            return Ok(ConsistentUnknowns::Run(Box::new(self.run(problem, &[t], wanted)?)));
        }
        let directions = &self.system.signature().directions;
        let n = problem.start.len();
        let mut s = vec![0.0; n * directions.len()];
        for (j, direction) in directions.iter().enumerate() {
            if let Direction::Start(i) = direction {
                s[j * n + i] = 1.0;
            }
        }
        Ok(ConsistentUnknowns::AsGiven { y: problem.start.iter().map(|(_, y)| *y).collect(), s })
    }

    fn run(
        &self,
        problem: &ModelProblem<'_>,
        times: &[f64],
        wanted: WantedResults<'_>,
    ) -> Result<Solution, TrialFailure> {
        dgd_runtime::SolvableSystem::integrate(problem, times, &self.options, wanted)
            .map_err(|failure| TrialFailure::Simulation(failure.error))
    }

    /// States that are held by their bounds, so that process noise does not act on them.
    pub(super) fn held(&self, at: &RunState, coordinates: &FilterCoordinates) -> Vec<usize> {
        let Some(memory) = &at.memory else { return Vec::new() };
        let discrete = &self.system.signature().discrete;
        let position = |i: &usize| coordinates.states.iter().position(|state| state == i);
        held_by_bounds(discrete, memory.z()).iter().filter_map(position).collect()
    }

    /// Parameters, and start values of all unknowns.
    fn started(
        &self,
        y: &[f64],
        coordinates: &FilterCoordinates,
        variables: &[f64],
    ) -> (Vec<f64>, Vec<(usize, f64)>) {
        let mut y = y.to_vec();
        coordinates.write_states(variables, &mut y);
        (coordinates.p(self.p, variables), y.into_iter().enumerate().collect())
    }

    /// The failure for undefined derivatives: the first such equation, or the whole model.
    fn undefined(&self, t: f64, solution: &Solution) -> TrialFailure {
        let named = solution.undefined.first().map(|undefined| undefined.equation.clone());
        let equation = named.unwrap_or_else(|| self.system.signature().name.to_string());
        TrialFailure::NoSensitivity { equation, t }
    }
}

/// The state at the end of a run.
fn ended(from: &RunState, run: &mut Solution) -> RunState {
    let mut past = from.past.clone();
    if let Some(past) = &mut past {
        past.go_on(run);
    }
    RunState { y: run.y(run.len() - 1).to_vec(), memory: run.memory.take(), past }
}

/// Rows of the states in derivatives of all unknowns, SI, converted to scaled variables.
fn rows_of_states(by: &DMatrix<f64>, coordinates: &FilterCoordinates) -> DMatrix<f64> {
    DMatrix::from_fn(coordinates.n_states(), by.ncols(), |row, column| {
        by[(coordinates.states[row], column)] / coordinates.sizes[row]
    })
}

/// Rows of the states of ∂y/∂θ, or of its slopes, in scaled variables: states × all.
fn transition(
    s: &[f64],
    n: usize,
    coordinates: &FilterCoordinates,
    variables: &[f64],
) -> DMatrix<f64> {
    DMatrix::from_fn(coordinates.n_states(), coordinates.len(), |row, column| {
        let slope = coordinates.slope(column, variables[column]);
        let entry = coordinates.directions[column] * n + coordinates.states[row];
        s[entry] * slope / coordinates.sizes[row]
    })
}
