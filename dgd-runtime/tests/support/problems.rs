//! Problems with known solutions.

use super::{Equations, Number, Stacked};

/// ẋ = u − k x, x(0) = x₀.
pub struct Relaxation;

impl Equations for Relaxation {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("x", 1.0, true)];
    const PARAMETERS: &'static [(&'static str, f64)] = &[("k", 0.7), ("x0", 2.0)];
    const INPUTS: &'static [&'static str] = &["u"];

    fn f<T: Number>(_: T, y: &[T], u: &[T], p: &[T], f: &mut [T]) {
        f[0] = u[0] - p[0] * y[0];
    }

    fn start<T: Number>(_: &[T], p: &[T], y: &mut [T]) {
        y[0] = p[1];
    }
}

pub type RelaxationStacked = Stacked<1, 2, 1, 1, 2>;

/// ẋ = r x (1 − x / K), x(0) = x₀. The clock is not read.
pub struct Logistic;

impl Equations for Logistic {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("x", 1.0, true)];
    const PARAMETERS: &'static [(&'static str, f64)] = &[("r", 1.3), ("K", 2.0), ("x0", 0.1)];
    const INPUTS: &'static [&'static str] = &["clock"];

    fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
        f[0] = p[0] * y[0] * (T::from(1.0) - y[0] / p[1]);
    }

    fn start<T: Number>(_: &[T], p: &[T], y: &mut [T]) {
        y[0] = p[2];
    }
}

pub type LogisticStacked = Stacked<1, 3, 1, 1, 3>;

impl Logistic {
    /// x and its derivatives with respect to r, K and x₀.
    pub fn solution(t: f64, p: &[f64]) -> [f64; 4] {
        let (r, k, x0) = (p[0], p[1], p[2]);
        let e = (-r * t).exp();
        let d = x0 + (k - x0) * e;
        let x = k * x0 / d;
        [x, k * x0 * (k - x0) * t * e / (d * d), x0 * x0 * (1.0 - e) / (d * d), k * k * e / (d * d)]
    }
}

/// [`Logistic`] with its rate as an algebraic unknown: ẋ = r z, 0 = x (1 − x/K) − z.
pub struct LogisticDae;

impl Equations for LogisticDae {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("x", 1.0, true), ("z", 1.0, false)];
    const PARAMETERS: &'static [(&'static str, f64)] = Logistic::PARAMETERS;
    const INPUTS: &'static [&'static str] = &["clock"];

    fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
        f[0] = p[0] * y[1];
        f[1] = y[0] * (T::from(1.0) - y[0] / p[1]) - y[1];
    }

    fn start<T: Number>(_: &[T], p: &[T], y: &mut [T]) {
        y[0] = p[2];
        y[1] = T::from(0.0);
    }
}

impl LogisticDae {
    /// x, z, and their derivatives (∂x, ∂z) with respect to r, K and x₀.
    pub fn solution(t: f64, p: &[f64]) -> ([f64; 2], [f64; 6]) {
        let [x, xr, xk, x0] = Logistic::solution(t, p);
        let k = p[1];
        let slope = 1.0 - 2.0 * x / k;
        let z = x * (1.0 - x / k);
        ([x, z], [xr, slope * xr, xk, slope * xk + x * x / (k * k), x0, slope * x0])
    }
}

/// Index 1: ẋ = −a z² / x, 0 = b² x² − z², with x = x₀ e^(−a b² t) and z = b x. The
/// clock is not read.
pub struct Algebraic;

impl Equations for Algebraic {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("x", 1.0, true), ("z", 1.0, false)];
    const PARAMETERS: &'static [(&'static str, f64)] = &[("a", 0.5), ("b", 1.2), ("x0", 1.5)];
    const INPUTS: &'static [&'static str] = &["clock"];

    fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
        f[0] = -p[0] * y[1] * y[1] / y[0];
        f[1] = p[1] * p[1] * y[0] * y[0] - y[1] * y[1];
    }

    fn start<T: Number>(_: &[T], p: &[T], y: &mut [T]) {
        y[0] = p[2];
        y[1] = T::from(1.0);
    }
}

pub type AlgebraicStacked = Stacked<2, 6, 1, 4, 12>;

impl Algebraic {
    /// x, z, and their derivatives (∂x, ∂z) with respect to a, b and x₀.
    pub fn solution(t: f64, p: &[f64]) -> ([f64; 2], [f64; 6]) {
        let (a, b, x0) = (p[0], p[1], p[2]);
        let x = x0 * (-a * b * b * t).exp();
        let (xa, xb, x0_) = (-b * b * t * x, -2.0 * a * b * t * x, x / x0);
        ([x, b * x], [xa, b * xa, xb, x + b * xb, x0_, b * x0_])
    }
}

/// Robertson's kinetics, as an ordinary system.
pub struct Robertson;

/// Robertson's kinetics with conservation of mass as an algebraic equation.
pub struct RobertsonDae;

const RATES: &[(&str, f64)] = &[("k1", 0.04), ("k2", 3e7), ("k3", 1e4)];

impl Equations for Robertson {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] =
        &[("a", 1.0, true), ("b", 1e-5, true), ("c", 1.0, true)];
    const PARAMETERS: &'static [(&'static str, f64)] = RATES;

    fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
        f[0] = p[2] * y[1] * y[2] - p[0] * y[0];
        f[2] = p[1] * y[1] * y[1];
        f[1] = -(f[0] + f[2]);
    }

    fn start<T: Number>(_: &[T], _: &[T], y: &mut [T]) {
        y[0] = T::from(1.0);
        y[1] = T::from(0.0);
        y[2] = T::from(0.0);
    }
}

impl Equations for RobertsonDae {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] =
        &[("a", 1.0, true), ("b", 1e-5, true), ("c", 1.0, false)];
    const PARAMETERS: &'static [(&'static str, f64)] = RATES;

    fn f<T: Number>(t: T, y: &[T], u: &[T], p: &[T], f: &mut [T]) {
        Robertson::f(t, y, u, p, f);
        f[2] = y[0] + y[1] + y[2] - T::from(1.0);
    }

    fn start<T: Number>(u: &[T], p: &[T], y: &mut [T]) {
        Robertson::start(u, p, y);
    }
}

pub type RobertsonStacked = Stacked<3, 9, 0, 9, 27>;
pub type RobertsonDaeStacked = Stacked<3, 9, 0, 9, 27>;

/// Van der Pol's oscillator with μ = 1000, as in the Test Set for IVP Solvers without scaled time.
pub struct VanDerPol;

impl Equations for VanDerPol {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("x", 1.0, true), ("v", 1.0, true)];
    const PARAMETERS: &'static [(&'static str, f64)] = &[("mu", 1000.0)];

    fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
        f[0] = y[1];
        f[1] = p[0] * (T::from(1.0) - y[0] * y[0]) * y[1] - y[0];
    }

    fn start<T: Number>(_: &[T], _: &[T], y: &mut [T]) {
        y[0] = T::from(2.0);
        y[1] = T::from(0.0);
    }
}

pub type VanDerPolStacked = Stacked<2, 2, 0, 4, 4>;

/// A tank that fills through a throttle until levels are equal, and then stays at rest: A ḣ = q − A u, 0 = a (5 − h) −
/// b q|q|.
///
/// Without u, q falls linearly to zero, at a time t* after which ∂f/∂q = 0.
pub struct Tank;

impl Equations for Tank {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("h", 5.0, true), ("q", 1.0, false)];
    const PARAMETERS: &'static [(&'static str, f64)] = &[("a", 2.0), ("b", 0.5), ("area", 3.0)];
    const INPUTS: &'static [&'static str] = &["u"];

    fn f<T: Number>(_: T, y: &[T], u: &[T], p: &[T], f: &mut [T]) {
        f[0] = y[1] / p[2] - u[0];
        f[1] = p[0] * (T::from(5.0) - y[0]) - p[1] * y[1] * y[1].abs();
    }

    fn start<T: Number>(_: &[T], _: &[T], y: &mut [T]) {
        y[0] = T::from(1.0);
        y[1] = T::from(0.0);
    }
}

pub type TankStacked = Stacked<2, 6, 1, 4, 12>;

impl Tank {
    /// Time at which the tank is full.
    pub fn arrival(p: &[f64]) -> f64 {
        // x = 5 − h: ẋ = −k √x with k = √(a/b)/A, so √x falls by k t / 2.
        2.0 * 4.0_f64.sqrt() * p[2] * (p[1] / p[0]).sqrt()
    }

    /// h and q.
    pub fn solution(t: f64, p: &[f64]) -> [f64; 2] {
        let k = (p[0] / p[1]).sqrt() / p[2];
        let root = (4.0_f64.sqrt() - 0.5 * k * t).max(0.0);
        [5.0 - root * root, (p[0] / p[1]).sqrt() * root]
    }

    /// (∂h, ∂q)/∂a, before the arrival.
    pub fn sensitivity_to_a(t: f64, p: &[f64]) -> [f64; 2] {
        let (a, b, area) = (p[0], p[1], p[2]);
        let c = (a / b).sqrt();
        let root = 2.0 - 0.5 * c * t / area;
        let dc = 0.5 * c / a;
        let droot = -0.5 * dc * t / area;
        [-2.0 * root * droot, dc * root + c * droot]
    }
}

/// ẋ = z − x, 0 = z² − (k u)²: an algebraic unknown that jumps with its input.
pub struct Follower;

impl Equations for Follower {
    const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("x", 1.0, true), ("z", 1.0, false)];
    const PARAMETERS: &'static [(&'static str, f64)] = &[("k", 2.0)];
    const INPUTS: &'static [&'static str] = &["u"];

    fn f<T: Number>(_: T, y: &[T], u: &[T], p: &[T], f: &mut [T]) {
        let target = p[0] * u[0];
        f[0] = y[1] - y[0];
        f[1] = y[1] * y[1] - target * target;
    }

    fn start<T: Number>(_: &[T], _: &[T], y: &mut [T]) {
        y[0] = T::from(0.0);
        // A guess at which the slope of the equation is zero.
        y[1] = T::from(0.0);
    }
}

pub type FollowerStacked = Stacked<2, 2, 1, 4, 4>;

/// Problems that cannot be finished.
pub mod hopeless {
    use super::{Equations, Number};

    const ONE: &[(&str, f64, bool)] = &[("x", 1.0, true)];
    const K: &[(&str, f64)] = &[("k", 1.0)];

    /// ẋ = k x², which is infinite at t = 1.
    pub struct Explosion;

    impl Equations for Explosion {
        const UNKNOWNS: &'static [(&'static str, f64, bool)] = ONE;
        const PARAMETERS: &'static [(&'static str, f64)] = K;

        fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
            f[0] = p[0] * y[0] * y[0];
        }

        fn start<T: Number>(_: &[T], _: &[T], y: &mut [T]) {
            y[0] = T::from(1.0);
        }
    }

    /// ẋ = −k + 0.1 √x, which is not defined below zero.
    pub struct BelowZero;

    impl Equations for BelowZero {
        const UNKNOWNS: &'static [(&'static str, f64, bool)] = ONE;
        const PARAMETERS: &'static [(&'static str, f64)] = K;

        fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
            f[0] = y[0].sqrt() * 0.1 - p[0];
        }

        fn start<T: Number>(_: &[T], _: &[T], y: &mut [T]) {
            y[0] = T::from(1.0);
        }
    }

    /// 0 = z² + k, which has no solution.
    pub struct NoRoot;

    impl Equations for NoRoot {
        const UNKNOWNS: &'static [(&'static str, f64, bool)] = &[("z", 1.0, false)];
        const PARAMETERS: &'static [(&'static str, f64)] = K;

        fn f<T: Number>(_: T, y: &[T], _: &[T], p: &[T], f: &mut [T]) {
            f[0] = y[0] * y[0] + p[0];
        }

        fn start<T: Number>(_: &[T], _: &[T], y: &mut [T]) {
            y[0] = T::from(0.5);
        }
    }
}
