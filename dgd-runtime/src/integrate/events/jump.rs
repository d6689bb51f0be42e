//! Jumps: modes that tie states together are entered with an impulse.
//!
//! The equations, integrated over the instant, say by how much states jump:
//!
//! ```text
//!   H d = −c(y⁺),   y⁺ = y⁻ + d          d: jumps of states, impulses of algebraic unknowns
//!   H dD = −(dc/dθ + Σ dH/dθ d),         along D, the total derivatives at the time of the instant
//! ```
//!
//! c are the constraints of the new modes, so that the other rows of H are linear: charge and momentum are conserved if
//! the equations imply it. A reset acts first, and the unknowns that it resets do not jump. If H is singular, or c
//! cannot be satisfied, states keep their values, and the unknowns that constraints determine jump onto them.

use crate::integrate::events::saltation::Saltation;
use crate::integrate::simulation::Simulation;
use crate::linalg::Factorisation;
use crate::linalg::norm::Tolerances;
use crate::problem::Problem;
use crate::solution::{Jump, JumpCause, Solution};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, JumpKind, Storage};

/// Corrections of a jump end if they are below this fraction of the tolerance.
const CONVERGED: f64 = 1e-3;
const MOST_CORRECTIONS: usize = 30;

/// Work space for jumps.
pub(in crate::integrate) struct JumpWorkspace<S: SolvableSystem> {
    /// Kinds of the single unknowns in the current modes; none if no mode ties states together.
    kinds: Vec<JumpKind>,
    numbers: Vec<f64>,
    rests: Vec<f64>,
    jacobian: Vec<f64>,
    factorisation: S::Factorisation,
    /// Unknowns just before, which of them had derivatives, and which the transition resets.
    left: S::Vector,
    had_rate: Vec<bool>,
    is_reset: Vec<bool>,
    /// Whether the jump is that of the equations.
    is_made: bool,
    /// Jumps and impulses, and right-hand sides.
    jump: S::Vector,
    correction: S::Vector,
    drests: Vec<f64>,
    drestsdt: Vec<f64>,
    djacobian: Vec<f64>,
    djacobiandt: Vec<f64>,
}

impl<S: SolvableSystem> JumpWorkspace<S> {
    pub(in crate::integrate) fn new(system: &S, n_s: usize) -> Self {
        let signature = system.signature();
        let pattern = &signature.discrete.jump_jacobian;
        let n = signature.unknowns.len();
        let has_equations = !pattern.is_empty();
        let single = if has_equations { signature.unknowns.single.len() } else { 0 };
        let n_s = if has_equations { n_s } else { 0 };
        let zeros = |n: usize| vec![0.0; n];
        let vector = || S::Vector::zeros(n);
        Self {
            kinds: vec![JumpKind::None; single],
            numbers: zeros(single),
            rests: zeros(single),
            jacobian: zeros(pattern.len()),
            factorisation: S::Factorisation::new(n, pattern),
            left: vector(),
            had_rate: vec![false; n],
            is_reset: vec![false; n],
            is_made: false,
            jump: vector(),
            correction: vector(),
            drests: zeros(single * n_s),
            drestsdt: zeros(single),
            djacobian: zeros(pattern.len() * n_s),
            djacobiandt: zeros(pattern.len()),
        }
    }

    fn kind(&self, i: usize) -> JumpKind {
        self.kinds.get(i).copied().unwrap_or(JumpKind::None)
    }

    /// Whether an unknown has a derivative in the current modes, be it as a state or by a constraint.
    pub(super) fn has_rate(&self, i: usize) -> bool {
        self.kind(i).has_rate()
    }

    /// Whether a row of H is that of an equation.
    fn has_equation(&self, i: usize) -> bool {
        self.kind(i).has_equation() && !(self.is_reset[i] && self.kind(i).jumps())
    }

    /// Sets rows without an equation to zero, and factorises −H with a one in these, with unknowns of these sizes.
    fn factorise(&mut self, system: &S, sizes: &[f64]) -> bool {
        let pattern = &system.signature().discrete.jump_jacobian;
        let mut jacobian = std::mem::take(&mut self.jacobian);
        pattern.for_each_mut(&mut jacobian, |row, _, value| {
            if !self.has_equation(row) {
                *value = 0.0;
            }
        });
        self.jacobian = jacobian;
        let Self { kinds, is_reset, factorisation, jacobian, .. } = self;
        let is_free = |i: usize| {
            let kind = kinds.get(i).copied().unwrap_or(JumpKind::None);
            !kind.has_equation() || (is_reset[i] && kind.jumps())
        };
        factorisation.factorise(1.0, is_free, pattern, jacobian, Some(sizes)).is_ok()
    }
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Evaluates the kinds of the current modes, and the equations of jumps at y.
    pub(in crate::integrate) fn evaluate_jumps(&mut self) {
        let Some(jumps) = self.jumps.as_deref_mut().filter(|jumps| !jumps.kinds.is_empty()) else {
            return;
        };
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let point = EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
        let JumpWorkspace { kinds, numbers, rests, jacobian, .. } = jumps;
        system.jumps(point, numbers, rests, jacobian);
        for (kind, number) in kinds.iter_mut().zip(numbers) {
            *kind = JumpKind::of_number(*number);
        }
    }

    /// Makes the jumps on entering modes by the k-th transition, after its resets: of unknowns, and of their total
    /// derivatives. The kinds are those of the new modes.
    pub(super) fn jump_onto_constraints(&mut self, k: usize, had_rate: &[bool]) {
        let Some(jumps) = self.jumps.as_deref_mut() else { return };
        jumps.left.as_mut().copy_from_slice(self.y.as_ref());
        jumps.jump.as_mut().fill(0.0);
        jumps.is_made = false;
        jumps.is_reset.fill(false);
        let discrete = &self.problem.system.signature().discrete;
        let resets = discrete.transitions().nth(k).map(|(_, transition)| &transition.resets);
        for i in resets.into_iter().flat_map(|resets| resets.iter()) {
            jumps.is_reset[*i] = true;
        }
        jumps.had_rate.copy_from_slice(had_rate);
        if !jumps.kinds.iter().any(|kind| kind.has_equation()) {
            return;
        }
        let has_resets = jumps.is_reset.contains(&true);
        let mut is_made = self.make_jump();
        if !is_made && has_resets {
            // All that constraints tie together has been reset, so that they decide.
            if let Some(jumps) = self.jumps.as_deref_mut() {
                jumps.is_reset.fill(false);
            }
            is_made = self.make_jump();
        }
        if let Some(jumps) = self.jumps.as_deref_mut() {
            jumps.is_made = is_made;
        }
    }

    /// Whether a jump has been found that the equations allow.
    fn make_jump(&mut self) -> bool {
        for _ in 0..MOST_CORRECTIONS {
            self.evaluate_jumps();
            let system = self.problem.system;
            let Some(jumps) = self.jumps.as_deref_mut() else { return false };
            if !jumps.factorise(system, self.sizes.as_ref()) {
                break;
            }
            for i in 0..jumps.rests.len() {
                let residual = if jumps.has_equation(i) { jumps.rests[i] } else { 0.0 };
                jumps.correction.as_mut()[i] = residual;
            }
            jumps.correction.as_mut()[jumps.rests.len()..].fill(0.0);
            jumps.factorisation.solve(jumps.correction.as_mut());
            let Tolerances { rtol, atol } = self.tolerances;
            let (mut is_small, mut is_finite) = (true, true);
            let y = self.y.as_mut();
            for (i, correction) in jumps.correction.as_ref().iter().enumerate() {
                is_finite &= correction.is_finite();
                jumps.jump.as_mut()[i] += correction;
                if jumps.kind(i).jumps() {
                    y[i] += correction;
                    let bearable = rtol * y[i].abs() + atol * self.sizes.as_ref()[i];
                    is_small &= correction.abs() <= CONVERGED * bearable;
                }
            }
            if !is_finite {
                break;
            }
            if is_small {
                self.jump_sensitivities();
                return true;
            }
        }
        let Some(jumps) = self.jumps.as_deref_mut() else { return false };
        self.y.as_mut().copy_from_slice(jumps.left.as_ref());
        jumps.jump.as_mut().fill(0.0);
        false
    }

    /// Total derivatives just after a jump; −H is factorised there.
    fn jump_sensitivities(&mut self) {
        let Some(jumps) = self.jumps.as_deref_mut() else { return };
        if self.directions.is_none() {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let discrete = &system.signature().discrete;
        let n = self.y.as_ref().len();
        let (u, udot) = self.drive.with_slope(self.t, self.y.as_ref());
        let point =
            EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: &self.discrete.schedule.z };
        let Saltation { tau, total, .. } = &mut self.discrete.saltation;
        let JumpWorkspace { drests, drestsdt, djacobian, djacobiandt, .. } = jumps;
        system.jump_sensitivities(point, udot, total, drests, drestsdt, djacobian, djacobiandt);
        let (single, n_h) = (jumps.kinds.len(), jumps.djacobiandt.len());
        for (j, tau) in tau.iter().enumerate() {
            let along = |slope: f64| if *tau == 0.0 { 0.0 } else { slope * tau };
            let mut correction = jumps.correction.take();
            let djumps = correction.as_mut();
            djumps.fill(0.0);
            let drests = &jumps.drests[j * single..];
            for ((djump, drest), slope) in
                djumps.iter_mut().zip(drests).zip(&jumps.drestsdt[..single])
            {
                *djump = drest + along(*slope);
            }
            for (h, (row, column)) in discrete.jump_jacobian.positions().enumerate() {
                // The derivatives of constraints, at y⁺, have theirs already.
                if jumps.kind(row) == JumpKind::Impulse && jumps.kind(column).jumps() {
                    continue;
                }
                let slope = jumps.djacobian[j * n_h + h] + along(jumps.djacobiandt[h]);
                djumps[row] += slope * jumps.jump.as_ref()[column];
            }
            for (i, djump) in djumps.iter_mut().enumerate() {
                if !jumps.has_equation(i) {
                    *djump = 0.0;
                }
            }
            jumps.factorisation.solve(djumps);
            for (i, djump) in djumps.iter().enumerate() {
                if jumps.kind(i).jumps() {
                    total[j * n + i] += djump;
                }
            }
            jumps.correction = correction;
        }
    }

    /// Records the states that have jumped at the last transition although no sum is conserved, and those whose jumps
    /// the equations do not give.
    pub(super) fn tell_jumps(&self, solution: &mut Solution) {
        let Some(jumps) = self.jumps.as_deref() else { return };
        let Tolerances { rtol, atol } = self.tolerances;
        let (left, y) = (jumps.left.as_ref(), self.y.as_ref());
        let moved = |i: usize| {
            let bearable = rtol * left[i].abs().max(y[i].abs()) + atol * self.sizes.as_ref()[i];
            (y[i] - left[i]).abs() > bearable
        };
        let states = || (0..y.len()).filter(|i| jumps.had_rate[*i] && !jumps.is_reset[*i]);
        let has_impulse = states().any(|i| jumps.kind(i).jumps() && moved(i));
        for i in states() {
            let cause = match jumps.kind(i) {
                JumpKind::Shared if jumps.is_made => continue,
                JumpKind::Lost if !has_impulse => continue,
                JumpKind::Lost => JumpCause::Lost,
                _ if moved(i) => JumpCause::Forced,
                _ => continue,
            };
            let (t, from, to) = (self.t, left[i], y[i]);
            solution.note_jump(Jump { t, unknown: i, from, to, cause, times: 1 });
        }
    }
}
