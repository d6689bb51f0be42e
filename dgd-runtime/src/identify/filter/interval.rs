//! The model over one interval, and its derivatives at one time.
//!
//! A run over one interval begins with all unknowns given, algebraic ones as guesses. A run of no length
//! makes them consistent and gives S = ∂y/∂(x, θ) there; with it the generated functions give
//!
//! It also begins in the modes in which the one before has ended.
//!
//! ```text
//!   A = ∂ẋ/∂(x, θ) = rows of x of (∂f/∂y S + ∂f/∂θ),    C = dw/d(x, θ) = ∂w/∂y S + ∂w/∂θ
//! ```

use nalgebra::DMatrix;

use super::coordinates::Coordinates;
use super::error::FilterError;
use super::problem::FilterProblem;
use crate::delay::delays;
use crate::error::IntegrateError;
use crate::identify::error::TrialFailure;
use crate::integrate::{Memory, Wanted, held_by_bounds};
use crate::observe::observe;
use crate::problem::{Options, Problem};
use crate::signal::{Inputs, Side};
use crate::solution::Solution;
use crate::system::{Direction, Point, Signature, System};

/// A model as a filter sees it.
pub(super) struct Model<'a, S> {
    pub system: &'a S,
    pub p: &'a [f64],
    pub options: Options,
    /// Whether all unknowns are differential, and nothing changes at events.
    is_plain: bool,
}

/// Where a run begins or has ended.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// Unknowns: guesses of the algebraic ones.
    pub y: Vec<f64>,
    /// Modes, and what else the run before remembers.
    pub memory: Option<Memory>,
}

/// Where an interval ended.
pub(super) struct Moved {
    pub place: Place,
    /// ∂x/∂(x, θ) in scaled variables: states × all.
    pub phi: DMatrix<f64>,
}

/// Unknowns at one time and their sensitivities.
enum Consistent {
    /// Where all are states, they are what they are.
    AsGiven { y: Vec<f64>, s: Vec<f64> },
    /// From a run of no length.
    Run(Box<Solution>),
}

/// The model close to one time.
pub(super) struct Local {
    /// Unknowns, consistent.
    pub y: Vec<f64>,
    /// Outputs.
    pub w: Vec<f64>,
    /// ∂x/∂(x, θ) in scaled variables: states × all. Rows of states that are algebraic here are what follows
    /// from the others.
    pub phi: DMatrix<f64>,
    /// A in scaled variables: states × all.
    pub a: DMatrix<f64>,
    /// C in scaled variables: outputs, SI, × all.
    pub c: DMatrix<f64>,
}

impl<'a, S: System> Model<'a, S> {
    /// # Errors
    ///
    /// [`FilterError::Remembers`] for a model that does not go on from its differential unknowns alone.
    pub(super) fn new(problem: &FilterProblem<'a, S>) -> Result<Self, FilterError> {
        let FilterProblem { system, p, options, .. } = *problem;
        let signature = system.signature();
        if let Some(what) = remembered(signature) {
            return Err(FilterError::Remembers { what });
        }
        let is_differential = |i: usize| signature.unknowns.is_differential(i);
        let is_plain =
            signature.discrete.is_empty() && (0..signature.unknowns.len()).all(is_differential);
        Ok(Self { system, p, options, is_plain })
    }

    /// How far delayed inputs reach back, s.
    pub(super) fn reach(&self, p: &[f64]) -> f64 {
        let inputs = Inputs::none();
        let problem = Problem { system: self.system, p, inputs: &inputs, start: &[] };
        delays(&problem).into_iter().filter(|tau| tau.is_finite()).fold(0.0, f64::max)
    }

    /// Moves the unknowns from one time to another, with sensitivities.
    pub(super) fn move_with_sensitivities(
        &self,
        inputs: &Inputs,
        times: (f64, f64),
        from: &Place,
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Moved, TrialFailure> {
        let (p, start) = self.started(&from.y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let wanted = Wanted::ResumedSensitivities(from.memory.as_ref());
        let mut solution = self.run(&problem, &[times.0, times.1], wanted)?;
        let last = solution.len() - 1;
        let phi = transition(solution.s(last), solution.n, coordinates, variables);
        if phi.iter().all(|value| value.is_finite()) {
            let place = Place { y: solution.y(last).to_vec(), memory: solution.memory.take() };
            Ok(Moved { place, phi })
        } else {
            Err(self.undefined(times.1, &solution))
        }
    }

    /// Moves the unknowns from one time to another.
    pub(super) fn move_states(
        &self,
        inputs: &Inputs,
        times: (f64, f64),
        from: &Place,
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Place, TrialFailure> {
        let (p, start) = self.started(&from.y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let wanted = Wanted::Resumed(from.memory.as_ref());
        let mut solution = self.run(&problem, &[times.0, times.1], wanted)?;
        let y = solution.y(solution.len() - 1).to_vec();
        Ok(Place { y, memory: solution.memory.take() })
    }

    /// Outputs at one time, for one set of states and parameters.
    pub(super) fn outputs(
        &self,
        inputs: &Inputs,
        t: f64,
        at: &Place,
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Vec<f64>, TrialFailure> {
        let (p, start) = self.started(&at.y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let solution = self.run(&problem, &[t], Wanted::Resumed(at.memory.as_ref()))?;
        Ok(observe(&problem, &solution).w)
    }

    /// The model close to one time.
    pub(super) fn local(
        &self,
        inputs: &Inputs,
        t: f64,
        at: &Place,
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Local, TrialFailure> {
        let (p, start) = self.started(&at.y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let consistent = self.consistent(&problem, t, at)?;
        let (y, s, z) = match &consistent {
            Consistent::AsGiven { y, s } => (y.as_slice(), s.as_slice(), &[][..]),
            Consistent::Run(run) => (run.y(0), run.s(0), run.z(0)),
        };

        let signature = self.system.signature();
        let mut u = vec![0.0; signature.n_u()];
        let read = problem.inputs_read();
        let read = read.map_err(|error| TrialFailure::Simulation(IntegrateError::Inputs(error)))?;
        read.value(t, Side::Right, &mut u);
        let at = Point { t, y, u: &u, p: &p, z };
        let (mut f, mut g) = (vec![0.0; y.len()], vec![0.0; s.len()]);
        self.system.sensitivity_rhs(at, s, &mut f, &mut g);
        let n_w = signature.outputs.len();
        let (mut w, mut dw) = (vec![0.0; n_w], vec![0.0; n_w * signature.directions.len()]);
        self.system.output_sensitivities(at, s, &mut w, &mut dw);

        let slope = |column: usize| coordinates.slope(column, variables[column]);
        let c = DMatrix::from_fn(n_w, coordinates.len(), |row, column| {
            dw[coordinates.directions[column] * n_w + row] * slope(column)
        });
        Ok(Local {
            y: y.to_vec(),
            w,
            phi: transition(s, y.len(), coordinates, variables),
            a: transition(&g, y.len(), coordinates, variables),
            c,
        })
    }

    /// Unknowns that fulfil the equations, and how they depend on states and parameters.
    fn consistent(
        &self,
        problem: &Problem<'_, S>,
        t: f64,
        at: &Place,
    ) -> Result<Consistent, TrialFailure> {
        if !self.is_plain {
            let wanted = Wanted::ResumedSensitivities(at.memory.as_ref());
            return Ok(Consistent::Run(Box::new(self.run(problem, &[t], wanted)?)));
        }
        let directions = &self.system.signature().directions;
        let n = problem.start.len();
        let mut s = vec![0.0; n * directions.len()];
        for (j, direction) in directions.iter().enumerate() {
            if let Direction::Start(i) = direction {
                s[j * n + i] = 1.0;
            }
        }
        Ok(Consistent::AsGiven { y: problem.start.iter().map(|(_, y)| *y).collect(), s })
    }

    fn run(
        &self,
        problem: &Problem<'_, S>,
        times: &[f64],
        wanted: Wanted<'_>,
    ) -> Result<Solution, TrialFailure> {
        S::integrate(problem, times, &self.options, wanted)
            .map_err(|failure| TrialFailure::Simulation(failure.error))
    }

    /// States that are held by their bounds: nothing makes them stray.
    pub(super) fn held(&self, at: &Place, coordinates: &Coordinates) -> Vec<usize> {
        let Some(memory) = &at.memory else { return Vec::new() };
        let discrete = &self.system.signature().discrete;
        let position = |i: &usize| coordinates.states.iter().position(|state| state == i);
        held_by_bounds(discrete, memory.z()).iter().filter_map(position).collect()
    }

    /// Parameters, and start values of all unknowns.
    fn started(
        &self,
        y: &[f64],
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> (Vec<f64>, Vec<(usize, f64)>) {
        let mut y = y.to_vec();
        coordinates.write_states(variables, &mut y);
        (coordinates.p(self.p, variables), y.into_iter().enumerate().collect())
    }

    /// Derivatives do not exist: the first equation to blame, or the model as a whole.
    fn undefined(&self, t: f64, solution: &Solution) -> TrialFailure {
        let named = solution.undefined.first().map(|undefined| undefined.equation.clone());
        let equation = named.unwrap_or_else(|| self.system.signature().name.to_string());
        TrialFailure::NoSensitivity { equation, t }
    }
}

/// Rows of the states of ∂y/∂θ, or of its slopes, in scaled variables: states × all.
fn transition(s: &[f64], n: usize, coordinates: &Coordinates, variables: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(coordinates.n_states(), coordinates.len(), |row, column| {
        let slope = coordinates.slope(column, variables[column]);
        let of = coordinates.directions[column] * n + coordinates.states[row];
        s[of] * slope / coordinates.sizes[row]
    })
}

/// What of the past a model or its outputs read, if there is something.
fn remembered(signature: &Signature) -> Option<String> {
    if let Some(delayed) = signature.delayed_unknowns.first() {
        let name = signature.unknowns.name(delayed.unknown);
        return Some(format!("what `{name}` was before"));
    }
    let late = signature.outputs.iter().find(|output| output.delay.is_some());
    late.map(|output| format!("what output `{}` reads late", output.name))
}
