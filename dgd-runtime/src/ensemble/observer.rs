//! Evaluates the outputs of one member at several times at once.

#![allow(clippy::inline_always)]

use super::lanes::{LANES, LanePoint, LaneStorage, Lanes};
use super::times::{PaddedTimes, eight};
use crate::problem::Problem;
use crate::signal::LimitSide;
use crate::solution::side;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// Work space.
pub(super) struct LaneObserver<S: SolvableSystem> {
    y: <S::Vector as Storage>::Lanes,
    u: <S::Inputs as Storage>::Lanes,
    now: S::Inputs,
    p: Vec<Lanes>,
    w: Vec<Lanes>,
    /// Output by output, each at all requested times.
    pub(super) outputs: Vec<f64>,
}

impl<S: SolvableSystem> LaneObserver<S> {
    /// Work space for `stride` numbers of each output; zero if outputs are not wanted.
    pub(super) fn new(system: &S, stride: usize) -> Self {
        let signature = system.signature();
        let n_w = signature.outputs.len();
        Self {
            y: <S::Vector as Storage>::Lanes::zeros(signature.unknowns.len()),
            u: <S::Inputs as Storage>::Lanes::zeros(signature.n_u()),
            now: S::Inputs::zeros(signature.n_u()),
            p: vec![Lanes::ZERO; signature.parameters.len()],
            w: vec![Lanes::ZERO; n_w],
            outputs: vec![0.0; n_w * stride],
        }
    }

    /// Evaluates the outputs at all `times`; `rows` has the unknowns, one after the other.
    #[inline(always)]
    pub(super) fn observe(
        &mut self,
        problem: &Problem<'_, S>,
        times: &PaddedTimes<'_>,
        rows: &[f64],
    ) {
        if self.outputs.is_empty() {
            return;
        }
        for (lanes, p) in self.p.iter_mut().zip(problem.p) {
            *lanes = Lanes::splat(*p);
        }
        let mut known_until = f64::NEG_INFINITY;
        for first in (0..times.asked.len()).step_by(LANES) {
            let t = times.eight(first);
            for (y, row) in self.y.lanes_mut().iter_mut().zip(rows.chunks_exact(times.stride())) {
                *y = eight(row, first);
            }
            if t.0[LANES - 1] >= known_until {
                known_until = self.read_inputs(problem, times.asked, first);
            }
            let point = LanePoint { t: &t, y: self.y.lanes(), u: self.u.lanes(), p: &self.p };
            problem.system.outputs_lanes(point, &mut self.w);
            for (w, row) in self.w.iter().zip(self.outputs.chunks_exact_mut(times.stride())) {
                row[first..first + LANES].copy_from_slice(&w.0);
            }
        }
    }

    /// Writes the inputs at these times, and returns the time until which they do not change.
    fn read_inputs(&mut self, problem: &Problem<'_, S>, times: &[f64], first: usize) -> f64 {
        let inputs = problem.inputs;
        // Lanes beyond the last time repeat it.
        let last = (first + LANES - 1).min(times.len() - 1);
        for l in 0..LANES {
            let k = (first + l).min(last);
            inputs.value(times[k], side(times, k), self.now.as_mut());
            for (lanes, u) in self.u.lanes_mut().iter_mut().zip(self.now.as_ref()) {
                lanes.0[l] = *u;
            }
        }
        let first = inputs.segment_at(times[first], side(times, first));
        let last = inputs.segment_at(times[last], LimitSide::Right);
        let segment = inputs.segment(last);
        if first == last && segment.is_constant() { segment.t1 } else { f64::NEG_INFINITY }
    }
}
