//! Parts shared by steps of both families: the numbers of all lanes, and inputs at a stage.

#![allow(clippy::inline_always)]

use super::lanes::{LANES, LanePoint, LaneStorage, Lanes};
use crate::linalg::norm::Tolerances;
use crate::signal::Segment;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// Inputs of each lane along its segment: u(t) = u₀ + u̇ (t − t₀).
pub(super) struct LaneInputs<S: SolvableSystem> {
    t0: Lanes,
    start: <S::Inputs as Storage>::Lanes,
    pub(super) slope: <S::Inputs as Storage>::Lanes,
    pub(super) now: <S::Inputs as Storage>::Lanes,
    /// Whether no input of any lane changes within its segment.
    is_constant: bool,
}

impl<S: SolvableSystem> LaneInputs<S> {
    pub(super) fn new(n_u: usize) -> Self {
        let zeros = || <S::Inputs as Storage>::Lanes::zeros(n_u);
        Self { t0: Lanes::ZERO, start: zeros(), slope: zeros(), now: zeros(), is_constant: true }
    }

    /// Continues with this segment in lane l.
    pub(super) fn enter(&mut self, l: usize, segment: Segment<'_>) {
        // A constant is defined at all times, and t₀ may be minus infinity.
        self.t0.0[l] = if segment.t0.is_finite() { segment.t0 } else { 0.0 };
        let (start, slope, now) =
            (self.start.lanes_mut(), self.slope.lanes_mut(), self.now.lanes_mut());
        for (i, (u, udot)) in segment.u.iter().zip(segment.udot).enumerate() {
            start[i].0[l] = *u;
            now[i].0[l] = *u;
            slope[i].0[l] = *udot;
        }
        self.is_constant = slope.iter().all(|slope| slope.0 == [0.0; LANES]);
        if !self.is_constant {
            return;
        }
        now.copy_from_slice(start);
    }

    /// Sets `now` to u at these times.
    #[inline(always)]
    pub(super) fn set(&mut self, t: Lanes) {
        if self.is_constant {
            return;
        }
        let lines = self.start.lanes().iter().zip(self.slope.lanes());
        for (now, (start, slope)) in self.now.lanes_mut().iter_mut().zip(lines) {
            *now = *start + *slope * (t - self.t0);
        }
    }
}

/// A step to try in each lane, from (t, y) by h.
pub(super) struct LaneTrial<'a, S: SolvableSystem> {
    pub(super) system: &'a S,
    pub(super) p: &'a [Lanes],
    /// 1 for a differential unknown, 0 for an algebraic one.
    pub(super) mass: &'a [f64],
    pub(super) t: &'a Lanes,
    pub(super) y: &'a [Lanes],
    pub(super) h: &'a Lanes,
    /// Sizes of the unknowns.
    pub(super) sizes: &'a [Lanes],
}

impl<S: SolvableSystem> LaneTrial<'_, S> {
    /// f at a stage c h into the step.
    #[inline(always)]
    pub(super) fn rhs(&self, c: f64, y: &[Lanes], inputs: &mut LaneInputs<S>, f: &mut [Lanes]) {
        let t = *self.t + c * *self.h;
        inputs.set(t);
        self.system.rhs_lanes(LanePoint { t: &t, y, u: inputs.now.lanes(), p: self.p }, f);
    }
}

/// Mean of (eᵢ / wᵢ)² in each lane, as
/// [`Tolerances::mean_square`].
#[inline(always)]
pub(super) fn mean_square(
    tolerances: Tolerances,
    e: &[Lanes],
    y: &[Lanes],
    y_new: &[Lanes],
    sizes: &[Lanes],
) -> Lanes {
    let mut sum = Lanes::ZERO;
    for (((e, y), y_new), size) in e.iter().zip(y).zip(y_new).zip(sizes) {
        let trusted =
            y_new.combine(y.combine(*size, Tolerances::most), |new, most| new.abs().min(most));
        let value = y.combine(trusted, |y, new| y.abs().max(new));
        let ratio = *e / value.combine(*size, |y, size| tolerances.weight(y, size));
        sum = sum + ratio * ratio;
    }
    let n = e.len().max(1) as f64;
    sum.map(|sum| sum / n)
}
