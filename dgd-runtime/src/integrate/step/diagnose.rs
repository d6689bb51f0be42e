//! Finds the error to report if no step is small enough.

use crate::algebraic::domain::domain_end;
use crate::algebraic::readings::readings;
use crate::error::{Evaluation, IntegrateError};
use crate::integrate::methods::non_finite::NonFinite;
use crate::integrate::methods::stepper::StepTrial;
use crate::integrate::simulation::{Simulation, base};
use crate::linalg::norm::Tolerances;
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

impl<S: SolvableSystem> Simulation<'_, S> {
    pub(in crate::integrate) fn singular_iteration(&self, h: f64, row: usize) -> IntegrateError {
        let equation = self.problem.system.signature().equations.get(row).to_string();
        IntegrateError::SingularIteration { t: self.t, h, equation }
    }

    pub(in crate::integrate) fn step_size_too_small(&mut self, h: f64) -> IntegrateError {
        let switch = self.passed_switch(h);
        let signature = self.problem.system.signature();
        let (y, y_new) = (self.y.as_ref(), self.stepper.y_new.as_ref());
        let n = y.len();
        let mut worst = (0, 0.0);
        let mut consider = |index: usize, e: f64, y: f64, y_new: f64, size: f64| {
            let value = Tolerances::judging(y, y_new, size);
            let error = e.abs() / self.tolerances.weight(value, size);
            if error > worst.1 {
                worst = (index, error);
            }
        };
        for (i, e) in self.stepper.local_error().iter().enumerate() {
            consider(i, *e, y[i], y_new[i], self.sizes.as_ref()[i]);
        }
        if let Some(d) = &self.directions {
            for (i, e) in self.stepper.sensitivity_error(d).iter().enumerate() {
                let (s, s_new) = (d.s.as_ref()[i], d.s_new.as_ref()[i]);
                consider(n + i, *e, s, s_new, d.sizes.as_ref()[i]);
            }
        }
        let (index, error) = worst;
        let parameter = (index / n)
            .checked_sub(1)
            .map(|direction| signature.direction_name(direction).to_string());
        IntegrateError::StepSizeTooSmall {
            t: self.t,
            h,
            unknown: signature.unknowns.name(index % n).to_string(),
            parameter,
            error,
            switch,
        }
    }

    /// The switch that the step of the size h, which was tried last, passes.
    fn passed_switch(&mut self, h: f64) -> Option<String> {
        let Problem { system, p, .. } = *self.problem;
        let discrete = &system.signature().discrete;
        let n_e = discrete.transitions().count();
        let z = self.discrete.z().to_vec();
        let mut evaluate = |t: f64, y: &[f64]| {
            let mut e = vec![0.0; n_e];
            let point = EvaluationPoint { t, y, u: self.drive.evaluate(t, y), p, z: &z };
            system.event_functions(point, &mut e);
            e
        };
        let before = evaluate(self.t, self.y.as_ref());
        let after = evaluate(self.t + h, self.stepper.y_new.as_ref());
        let passes = |k: usize| before[k] * after[k] <= 0.0 && before[k] != after[k];
        let mut transitions = discrete.transitions().enumerate();
        let (_, (automaton, _)) = transitions.find(|(k, (automaton, transition))| {
            self.discrete.is_active(*automaton, transition.from) && passes(*k)
        })?;
        Some(discrete.automata[automaton].name.to_string())
    }

    pub(in crate::integrate) fn not_finite(&mut self, h: f64) -> IntegrateError {
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let sizes = self.sizes.as_ref();
        let trial = StepTrial { base, y: &self.y, h, sizes, tolerances: self.tolerances };
        match self.stepper.non_finite(trial, &mut self.drive, self.directions.as_mut()) {
            Some((t, what)) => self.evaluation_not_finite(t, what),
            // Evaluations are finite, but the solution overflows.
            None => self.step_size_too_small(h),
        }
    }

    pub(in crate::integrate) fn evaluation_not_finite(
        &mut self,
        t: f64,
        what: NonFinite,
    ) -> IntegrateError {
        let (row, what) = match what {
            NonFinite::Equation(row) => (row, Evaluation::Equation),
            NonFinite::Derivative(row) => (row, Evaluation::Derivative),
        };
        let Problem { system, p, .. } = *self.problem;
        let signature = system.signature();
        let equation = signature.equations.get(row).to_string();
        let unknown = signature.unknowns.name(row).to_string();
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let point = EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
        let values = readings(system, point, row);
        let end = domain_end(system, point, row, self.sizes.as_ref()).map(Box::new);
        IntegrateError::NotFinite { t, equation, unknown, what, values, end }
    }

    pub(in crate::integrate) fn newton_diverged(&self, h: f64, unknown: usize) -> IntegrateError {
        let unknown = self.problem.system.signature().unknowns.name(unknown).to_string();
        IntegrateError::NewtonDiverged { t: self.t, h, unknown }
    }

    pub(in crate::integrate) fn too_many_steps(&self, steps: usize) -> IntegrateError {
        let (t, method) = (self.t, self.method.name);
        if self.stepper.is_stiff() {
            IntegrateError::TooStiff { t, steps, method }
        } else {
            IntegrateError::TooManySteps { t, steps }
        }
    }

    /// The method cannot solve for algebraic unknowns, and there are some.
    pub(in crate::integrate) fn unsuited_method(&self) -> IntegrateError {
        let signature = self.problem.system.signature();
        let masses = self.algebraic.mass.as_ref().iter().enumerate();
        let rows = masses.filter(|(_, mass)| **mass == 0.0).map(|(row, _)| row);
        let automata = &signature.discrete.automata;
        let slides = |row: usize| {
            let name = signature.equations.get(row).to_string();
            automata.iter().any(|automaton| automaton.kind.has_surface() && *automaton.name == name)
        };
        // Declarations of the model itself come first.
        let row = rows.min_by_key(|row| slides(*row)).unwrap_or(0);
        let (equation, slides) = (signature.equations.get(row).to_string(), slides(row));
        IntegrateError::UnsuitedMethod { t: self.t, method: self.method.name, equation, slides }
    }
}
