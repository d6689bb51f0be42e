//! A level and a flow, mildly stiff: eigenvalues near -0.34 and -0.0015 1/s.
//!
//! ```text
//!   A ḣ = q − q_out
//!   M q̇ = ρ g (5 − h + c0 w² − c1 w q − c2 q²) − F q²        P2: 0 = the right side
//! ```
//!
//! p = (M, c0, c1, c2, F) = nominal · θ; sensitivities are with respect to θ, so that they have the units of the
//! states.

/// ρ g, Pa/m.
pub const RHO_G: f64 = 1120.0 * 9.81;
/// A, m².
pub const AREA: f64 = 0.1976;
/// q_out of P1, P2 and P4, and the initial flow, m³/s.
pub const FLOW: f64 = 0.032;
/// The initial level, m.
pub const LEVEL: f64 = 40.0;
/// Sizes of h and q: absolute tolerances are relative to them.
pub const SIZES: [f64; 2] = [LEVEL, FLOW];
/// States and five sensitivities of each.
pub const WIDTH: usize = 12;
/// w before and after the jump at 100 s.
pub const SPEEDS: [f64; 2] = [0.8, 0.88];
/// The intervals of P1, P2 and P4 and the speed in each; outputs are at whole seconds.
pub const STRETCHES: [(u32, u32, f64); 2] = [(0, 100, SPEEDS[0]), (100, 1000, SPEEDS[1])];

/// Nominal parameters: steady at w = 0.8 with h = 40 m, q = 0.032 m³/s.
pub fn nominal() -> [f64; 5] {
    let (m, c1, c2, f, w) = (1.1e8, 500.0, 2e4, 3e8, SPEEDS[0]);
    let losses = f * FLOW * FLOW / RHO_G + c1 * w * FLOW + c2 * FLOW * FLOW;
    [m, (LEVEL - 5.0 + losses) / (w * w), c1, c2, f]
}

/// The model with numbers.
#[derive(Debug, Clone, Copy)]
pub struct TwoState {
    /// M, c0, c1, c2, F.
    pub p: [f64; 5],
    /// Pump speed.
    pub w: f64,
    /// Flow out of the volume, m³/s.
    pub q_out: f64,
}

impl TwoState {
    /// Nominal parameters, before the jump.
    pub fn start() -> Self {
        Self { p: nominal(), w: SPEEDS[0], q_out: FLOW }
    }

    /// Pressure that accelerates the flow, Pa.
    #[inline]
    pub fn imbalance(&self, h: f64, q: f64) -> f64 {
        let [_, c0, c1, c2, f] = self.p;
        let head = c0 * self.w * self.w - c1 * self.w * q - c2 * q * q;
        RHO_G * (5.0 - h + head) - f * q * q
    }

    /// (ḣ, q̇).
    #[inline]
    pub fn rhs(&self, h: f64, q: f64) -> [f64; 2] {
        [(q - self.q_out) / AREA, self.imbalance(h, q) / self.p[0]]
    }

    /// (∂q̇/∂h, ∂q̇/∂q); ∂ḣ/∂q = 1/A is the only other nonzero entry.
    #[inline]
    pub fn slopes(&self, q: f64) -> [f64; 2] {
        let [m, _, c1, c2, f] = self.p;
        [-RHO_G / m, (-RHO_G * c1 * self.w - 2.0 * (RHO_G * c2 + f) * q) / m]
    }

    /// ∂q̇/∂θ; in P2, where the right side over M is zero, the first entry is zero.
    #[inline]
    pub fn by_theta(&self, h: f64, q: f64) -> [f64; 5] {
        let ([m, c0, c1, c2, f], w) = (self.p, self.w);
        [
            -self.imbalance(h, q) / m,
            RHO_G * c0 * w * w / m,
            -RHO_G * c1 * w * q / m,
            -RHO_G * c2 * q * q / m,
            -f * q * q / m,
        ]
    }

    /// States and sensitivities together: ẏ = f, Ṡ = ∂f/∂y S + ∂f/∂θ; y and S scaled by [`SIZES`].
    #[inline]
    pub fn augmented(&self, y: &[f64; WIDTH]) -> [f64; WIDTH] {
        let (h, q) = (LEVEL * y[0], FLOW * y[1]);
        let ([by_h, by_q], by_theta) = (self.slopes(q), self.by_theta(h, q));
        let [hdot, qdot] = self.rhs(h, q);
        let mut ydot = [0.0; WIDTH];
        ydot[0] = hdot / LEVEL;
        ydot[1] = qdot / FLOW;
        for (j, by_theta) in by_theta.iter().enumerate() {
            let (s_h, s_q) = (LEVEL * y[2 + 2 * j], FLOW * y[3 + 2 * j]);
            ydot[2 + 2 * j] = s_q / AREA / LEVEL;
            ydot[3 + 2 * j] = (by_h * s_h + by_q * s_q + by_theta) / FLOW;
        }
        ydot
    }
}

/// The parameter sets of P4: nominal · (1 + 0.1 u), u uniform in −1 .. 1.
pub fn ensemble(count: usize) -> impl Iterator<Item = [f64; 5]> {
    let mut state: u64 = 12345;
    (0..count).map(move |_| {
        let mut p = nominal();
        for p in &mut p {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let unit = (state >> 11) as f64 / 9_007_199_254_740_992.0;
            *p *= 1.0 + 0.1 * (2.0 * unit - 1.0);
        }
        p
    })
}

/// Noise of h and q in the measurements for the fit.
pub const FIT_NOISE: [f64; 2] = [0.05, 2e-4];
/// Indices of the fitted parameters, M, c0 and c2, and factors of their initial values.
pub const FIT_START: [(usize, f64); 3] = [(0, 1.3), (1, 0.7), (3, 1.3)];
/// Initial values for a fit with F as well: the data determine only a combination of F and c2.
pub const RANK_START: [(usize, f64); 4] = [(0, 1.3), (1, 0.7), (3, 1.3), (4, 0.7)];

/// F1 of `fit6`, Pa s/m³: an additional linear friction.
pub const LINEAR_FRICTION: f64 = 2e6;
/// Noise of the measurements for `fit6`: h, q and the pressures before and after the pump, Pa.
pub const SIX_NOISE: [f64; 4] = [0.05, 2e-4, 1e3, 1e3];
/// Factors of the initial values of M, c0, c1, c2, F and F1 in `fit6`.
pub const SIX_START: [f64; 6] = [1.3, 0.7, 1.3, 0.7, 1.3, 0.7];

/// M, c0, c1, c2, F, F1.
pub fn nominal_six() -> [f64; 6] {
    let [m, c0, c1, c2, f] = nominal();
    [m, c0, c1, c2, f, LINEAR_FRICTION]
}

/// The identifiable combination of c2 and F: the coefficient of q².
pub fn square_losses(p: &[f64]) -> f64 {
    RHO_G * p[3] + p[4]
}

/// Number of parameter sets of P4.
pub const SETS: usize = 10_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_starts_at_rest() {
        let [hdot, qdot] = TwoState::start().rhs(LEVEL, FLOW);
        assert_eq!(hdot, 0.0);
        // The terms of the balance are of the order of 1e6 Pa.
        assert!(qdot.abs() <= 1e6 * f64::EPSILON / 1.1e8 * 4.0, "{qdot}");
    }

    #[test]
    fn derivatives_are_those_of_the_right_side() {
        let system = TwoState { w: 0.85, ..TwoState::start() };
        let (h, q) = (47.0, 0.035);
        let slope = |f: &dyn Fn(f64) -> f64| (f(1e-4) - f(-1e-4)) / 2e-4;
        // f is quadratic in everything except M: central differences are exact to rounding.
        let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-7 * b.abs() + 1e-12, "{a} {b}");
        let [by_h, by_q] = system.slopes(q);
        near(slope(&|d| system.rhs(h * (1.0 + d), q)[1]), by_h * h);
        near(slope(&|d| system.rhs(h, q * (1.0 + d))[1]), by_q * q);
        for (j, by_theta) in system.by_theta(h, q).into_iter().enumerate() {
            let moved = |d: f64| {
                let mut system = system;
                system.p[j] *= 1.0 + d;
                system.rhs(h, q)[1]
            };
            near(slope(&moved), by_theta);
        }
    }
}
