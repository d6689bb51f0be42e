//! A hydraulic line of n cells: 2n states p₁, q₂, p₂, q₃, …, so that the Jacobian is tridiagonal.
//!
//! ```text
//!   ṗᵢ = −β/(A Δx) (qᵢ₊₁ − qᵢ)
//!   q̇ᵢ₊₁ = −A/(ρ Δx) (pᵢ₊₁ − pᵢ) − K/ρ q |q| + A g
//! ```
//!
//! The inlet flow rises by 20 % within half a second from t = 1 s.

const LENGTH: f64 = 3000.0;
const BULK_MODULUS: f64 = 1.5e9;
const AREA: f64 = 0.0185;
const DENSITY: f64 = 1120.0;
const GRAVITY: f64 = 9.81;
const FRICTION: f64 = 3.0e4;
const OUTLET_PRESSURE: f64 = 3.3e7;
const FLOW: f64 = 0.03;
const RAMP: f64 = 0.5;

/// End of the run, s; outputs are p₁ at whole seconds.
pub const END: u32 = 20;

/// The line with its grid.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    n: usize,
    dx: f64,
}

impl Line {
    /// A line of `n` cells.
    pub fn new(n: usize) -> Self {
        Self { n, dx: LENGTH / n as f64 }
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        2 * self.n
    }

    /// The exact steady state of the discrete equations.
    pub fn start(&self, y: &mut [f64]) {
        let mut pressure = OUTLET_PRESSURE;
        for cell in y.chunks_exact_mut(2).rev() {
            pressure += self.dx * (FRICTION * FLOW * FLOW / AREA - DENSITY * GRAVITY);
            cell.copy_from_slice(&[pressure, FLOW]);
        }
    }

    /// ẏ.
    #[inline]
    pub fn rhs(&self, t: f64, y: &[f64], ydot: &mut [f64]) {
        let stiffness = BULK_MODULUS / AREA / self.dx;
        let inertia = AREA / DENSITY / self.dx;
        let mut before = inlet_flow(t);
        for i in 0..self.n {
            let (p, q) = (y[2 * i], y[2 * i + 1]);
            let after = if i + 1 < self.n { y[2 * i + 2] } else { OUTLET_PRESSURE };
            ydot[2 * i] = -stiffness * (q - before);
            ydot[2 * i + 1] =
                -inertia * (after - p) - FRICTION / DENSITY * q * q.abs() + AREA * GRAVITY;
            before = q;
        }
    }

    /// ∂ẏ/∂y v.
    #[inline]
    pub fn jacobian_times(&self, y: &[f64], v: &[f64], result: &mut [f64]) {
        let stiffness = BULK_MODULUS / AREA / self.dx;
        let inertia = AREA / DENSITY / self.dx;
        let mut before = 0.0;
        for i in 0..self.n {
            let (p, q) = (v[2 * i], v[2 * i + 1]);
            let after = if i + 1 < self.n { v[2 * i + 2] } else { 0.0 };
            result[2 * i] = -stiffness * (q - before);
            result[2 * i + 1] =
                -inertia * (after - p) - FRICTION / DENSITY * 2.0 * y[2 * i + 1].abs() * q;
            before = q;
        }
    }
}

/// A quintic step, twice differentiable: q₀ (1 + 0.2 x³ (10 − 15 x + 6 x²)).
fn inlet_flow(t: f64) -> f64 {
    let x = ((t - 1.0) / RAMP).clamp(0.0, 1.0);
    FLOW * (1.0 + 0.2 * x * x * x * (10.0 + x * (6.0 * x - 15.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_starts_at_rest() {
        let line = Line::new(10);
        let (mut y, mut ydot) = (vec![0.0; 20], vec![0.0; 20]);
        line.start(&mut y);
        line.rhs(0.0, &y, &mut ydot);
        // Pressures are near 3e7 Pa and are divided by ρ Δx / A = 1.8e7.
        assert!(ydot.iter().all(|x| x.abs() < 1e-14), "{ydot:?}");
    }
}
