//! Test problems: equations written once, differentiated with hyper-dual numbers, and wrapped as a [`System`] with
//! storage on the stack and on the heap.

#![allow(dead_code, unreachable_pub, missing_docs)]

mod hyper_dual;
mod jet;
pub mod problems;

use dgd_runtime::linalg::{AutoLu, FixedLu};
use dgd_runtime::taylor::{KeptSeries, NoTaylorSeries, SeriesTerms};
use dgd_runtime::{
    Direction, Discrete, EvaluationPoint, Failure, Input, Interpolation, Options, Output,
    Parameter, Pattern, Problem, Signature, Solution, SolvableSystem, System, Unit, Unknown,
    WantedResults,
};

pub use hyper_dual::{HyperDual, Number};
pub use jet::Jet;

/// Maximum number of unknowns, inputs or parameters of a test problem.
const MOST: usize = 16;

/// Equations of a test problem. Directions are all parameters.
pub trait Equations {
    /// Unknowns: name, nominal size, whether differential.
    const UNKNOWNS: &'static [(&'static str, f64, bool)];
    const PARAMETERS: &'static [(&'static str, f64)];
    const INPUTS: &'static [&'static str] = &[];
    fn f<T: Number>(t: T, y: &[T], u: &[T], p: &[T], f: &mut [T]);
    fn start<T: Number>(u: &[T], p: &[T], y: &mut [T]);
}

fn unit() -> Unit {
    Unit { symbol: "1".into(), factor: 1.0, offset: 0.0 }
}

fn full(rows: usize, columns: usize) -> Pattern {
    let positions = (0..columns).flat_map(|j| (0..rows).map(move |i| (i, j)));
    Pattern::from_places(&positions.collect::<Vec<_>>())
}

fn signature<E: Equations>() -> Signature {
    let (n, n_s) = (E::UNKNOWNS.len(), E::PARAMETERS.len());
    Signature {
        name: "test".into(),
        unknowns: E::UNKNOWNS
            .iter()
            .map(|&(name, nominal, differential)| Unknown {
                name: name.into(),
                unit: unit(),
                nominal: Some(nominal),
                differential,
            })
            .collect(),
        equations: E::UNKNOWNS.iter().map(|(name, ..)| format!("of_{name}").into()).collect(),
        parameters: E::PARAMETERS
            .iter()
            .map(|&(name, value)| Parameter {
                name: name.into(),
                unit: unit(),
                value,
                lower: f64::NEG_INFINITY,
                upper: f64::INFINITY,
                nominal: None,
                log: false,
                fixed: false,
            })
            .collect(),
        inputs: E::INPUTS
            .iter()
            .map(|&name| Input {
                name: name.into(),
                unit: unit(),
                // The equations work with inputs of either kind.
                interpolation: Interpolation::Linear,
            })
            .collect(),
        delays: Vec::new().into(),
        varying_delays: Vec::new().into(),
        delayed_inputs: Vec::new().into(),
        delayed_unknowns: Vec::new().into(),
        differentiated_inputs: Vec::new().into(),
        outputs: E::UNKNOWNS
            .iter()
            .map(|&(name, ..)| Output { name: name.into(), unit: unit(), noise: None, delay: None })
            .collect(),
        densities: Vec::new().into(),
        starts_at_rest: false,
        start_equations: Vec::new().into(),
        conserved: Vec::new().into(),
        directions: (0..n_s).map(Direction::Parameter).collect(),
        jacobian: full(n, n),
        sensitivity_jacobian: full(n * n_s, n),
        parameter_jacobian: full(n, n_s),
        input_jacobian: full(n, E::INPUTS.len()),
        output_jacobians: [full(n, n), full(n, E::INPUTS.len()), full(n, n_s)],
        discrete: Discrete::NONE,
    }
}

/// Declared parameter values.
pub fn parameters<E: Equations>() -> Vec<f64> {
    E::PARAMETERS.iter().map(|(_, value)| *value).collect()
}

/// A problem with its storage on the stack: N unknowns, NS = N · parameters, U inputs, J = N²,
/// G = N · NS.
pub struct Stacked<const N: usize, const NS: usize, const U: usize, const J: usize, const G: usize>
{
    signature: Signature,
    equations: Pointed,
}

/// A problem with its storage on the heap. Its equations are function pointers, so that solvers are compiled once and
/// not for each problem.
pub struct Heaped {
    signature: Signature,
    equations: Pointed,
}

type F<T> = fn(T, &[T], &[T], &[T], &mut [T]);
type Start<T> = fn(&[T], &[T], &mut [T]);

#[derive(Clone, Copy)]
struct Pointed {
    all_differential: bool,
    f: (F<f64>, F<HyperDual>, F<Jet>),
    start: (Start<f64>, Start<HyperDual>),
}

impl Pointed {
    fn at<E: Equations>() -> Self {
        Self {
            all_differential: E::UNKNOWNS.iter().all(|(.., differential)| *differential),
            f: (E::f::<f64>, E::f::<HyperDual>, E::f::<Jet>),
            start: (E::start::<f64>, E::start::<HyperDual>),
        }
    }
}

impl<const N: usize, const NS: usize, const U: usize, const J: usize, const G: usize>
    Stacked<N, NS, U, J, G>
{
    pub fn of<E: Equations>() -> Self {
        Self { signature: signature::<E>(), equations: Pointed::at::<E>() }
    }
}

impl Heaped {
    pub fn of<E: Equations>() -> Self {
        Self { signature: signature::<E>(), equations: Pointed::at::<E>() }
    }
}

/// f with derivatives along two directions of (t, y, u, p).
struct Seeds<'a> {
    at: EvaluationPoint<'a>,
    first: [&'a dyn Fn(Slot) -> f64; 2],
}

#[derive(Clone, Copy, PartialEq)]
enum Slot {
    T,
    Y(usize),
    U(usize),
    P(usize),
}

fn nothing(_: Slot) -> f64 {
    0.0
}

fn evaluate(equations: Pointed, seeds: &Seeds<'_>) -> [HyperDual; MOST] {
    let EvaluationPoint { t, y, u, p, .. } = seeds.at;
    let [a, b] = seeds.first;
    let number = |value, slot| HyperDual { value, a: a(slot), b: b(slot), ab: 0.0 };
    let zero = HyperDual::from(0.0);
    let (mut ys, mut us, mut ps) = ([zero; MOST], [zero; MOST], [zero; MOST]);
    for (i, v) in y.iter().enumerate() {
        ys[i] = number(*v, Slot::Y(i));
    }
    for (i, v) in u.iter().enumerate() {
        us[i] = number(*v, Slot::U(i));
    }
    for (i, v) in p.iter().enumerate() {
        ps[i] = number(*v, Slot::P(i));
    }
    let mut f = [zero; MOST];
    let n = y.len();
    (equations.f.1)(number(t, Slot::T), &ys[..n], &us[..u.len()], &ps[..p.len()], &mut f[..n]);
    f
}

/// Extends the series of y, and of a column of S for each direction, order by order.
fn expand(
    equations: Pointed,
    at: EvaluationPoint<'_>,
    udot: &[f64],
    h: f64,
    order: usize,
    y: &mut [f64],
    s: &mut [f64],
) {
    let n = at.y.len();
    let n_s = s.len() / y.len().max(1);
    y[..n].copy_from_slice(at.y);
    for k in 0..order {
        for j in 0..n_s.max(1) {
            let line = |value: f64, slope: f64| {
                let mut jet = Jet::from(value);
                jet.value[1] = h * slope;
                jet
            };
            let mut ys = [Jet::from(0.0); MOST];
            for (i, jet) in ys.iter_mut().enumerate().take(n) {
                for order in 0..=k {
                    jet.value[order] = y[order * n + i];
                    if n_s > 0 {
                        jet.derivative[order] = s[(order * n + i) * n_s + j];
                    }
                }
            }
            let us: Vec<Jet> = at.u.iter().zip(udot).map(|(u, udot)| line(*u, *udot)).collect();
            let mut ps: Vec<Jet> = at.p.iter().map(|p| Jet::from(*p)).collect();
            if let Some(p) = ps.get_mut(j) {
                p.derivative[0] = 1.0;
            }
            let mut f = [Jet::from(0.0); MOST];
            (equations.f.2)(line(at.t, 1.0), &ys[..n], &us, &ps, &mut f[..n]);
            let per = h / (k + 1) as f64;
            for (i, f) in f.iter().enumerate().take(n) {
                y[(k + 1) * n + i] = per * f.value[k];
                if n_s > 0 {
                    s[((k + 1) * n + i) * n_s + j] = per * f.derivative[k];
                }
            }
        }
    }
}

macro_rules! system {
    () => {
        fn signature(&self) -> &Signature {
            &self.signature
        }

        fn rhs(&self, at: EvaluationPoint<'_>, f: &mut [f64]) {
            (self.equations.f.0)(at.t, at.y, at.u, at.p, f);
        }

        fn linearize(
            &self,
            at: EvaluationPoint<'_>,
            udot: &[f64],
            f: &mut [f64],
            jacobian: &mut [f64],
            dfdt: &mut [f64],
        ) {
            let n = f.len();
            self.rhs(at, f);
            for k in 0..n {
                let y_k = |slot| f64::from(u8::from(slot == Slot::Y(k)));
                let d = evaluate(self.equations, &Seeds { at, first: [&y_k, &nothing] });
                for i in 0..n {
                    jacobian[k * n + i] = d[i].a;
                }
            }
            let time = |slot| match slot {
                Slot::T => 1.0,
                Slot::U(i) => udot[i],
                Slot::Y(_) | Slot::P(_) => 0.0,
            };
            let d = evaluate(self.equations, &Seeds { at, first: [&time, &nothing] });
            for i in 0..n {
                dfdt[i] = d[i].a;
            }
        }

        fn sensitivity_rhs(
            &self,
            at: EvaluationPoint<'_>,
            s: &[f64],
            f: &mut [f64],
            g: &mut [f64],
        ) {
            let n = f.len();
            self.rhs(at, f);
            for (j, g) in g.chunks_exact_mut(n).enumerate() {
                let along = |slot| match slot {
                    Slot::Y(i) => s[j * n + i],
                    Slot::P(i) => f64::from(u8::from(i == j)),
                    Slot::T | Slot::U(_) => 0.0,
                };
                let d = evaluate(self.equations, &Seeds { at, first: [&along, &nothing] });
                for i in 0..n {
                    g[i] = d[i].a;
                }
            }
        }

        fn sensitivity_linearize(
            &self,
            at: EvaluationPoint<'_>,
            udot: &[f64],
            s: &[f64],
            f: &mut [f64],
            jacobian: &mut [f64],
            dfdt: &mut [f64],
            g: &mut [f64],
            dgdy: &mut [f64],
            dgdt: &mut [f64],
        ) {
            let n = f.len();
            let rows = g.len();
            self.linearize(at, udot, f, jacobian, dfdt);
            self.sensitivity_rhs(at, s, f, g);
            for j in 0..rows / n {
                let along = |slot| match slot {
                    Slot::Y(i) => s[j * n + i],
                    Slot::P(i) => f64::from(u8::from(i == j)),
                    Slot::T | Slot::U(_) => 0.0,
                };
                for k in 0..n {
                    let y_k = |slot| f64::from(u8::from(slot == Slot::Y(k)));
                    let d = evaluate(self.equations, &Seeds { at, first: [&along, &y_k] });
                    for i in 0..n {
                        dgdy[k * rows + j * n + i] = d[i].ab;
                    }
                }
                let time = |slot| match slot {
                    Slot::T => 1.0,
                    Slot::U(i) => udot[i],
                    Slot::Y(_) | Slot::P(_) => 0.0,
                };
                let d = evaluate(self.equations, &Seeds { at, first: [&along, &time] });
                for i in 0..n {
                    dgdt[j * n + i] = d[i].ab;
                }
            }
        }

        fn taylor_series(&self) -> Result<KeptSeries, NoTaylorSeries> {
            let none = KeptSeries { unknowns: 0, sensitivities: 0, has_branches: true };
            if self.equations.all_differential { Ok(none) } else { Err(NoTaylorSeries::Algebraic) }
        }

        fn taylor(
            &self,
            at: EvaluationPoint<'_>,
            udot: &[f64],
            h: f64,
            order: usize,
            _: &mut [SeriesTerms],
            y: &mut [f64],
        ) {
            expand(self.equations, at, udot, h, order, y, &mut []);
        }

        fn sensitivity_taylor(
            &self,
            at: EvaluationPoint<'_>,
            udot: &[f64],
            h: f64,
            order: usize,
            _: &mut [SeriesTerms],
            y: &mut [f64],
            s: &mut [f64],
        ) {
            expand(self.equations, at, udot, h, order, y, s);
        }

        fn parameter_jacobian(&self, at: EvaluationPoint<'_>, values: &mut [f64]) {
            let s = vec![0.0; at.y.len() * at.p.len()];
            let mut f = vec![0.0; at.y.len()];
            self.sensitivity_rhs(at, &s, &mut f, values);
        }

        fn input_jacobian(&self, at: EvaluationPoint<'_>, values: &mut [f64]) {
            let n = at.y.len();
            for k in 0..at.u.len() {
                let u_k = |slot| f64::from(u8::from(slot == Slot::U(k)));
                let d = evaluate(self.equations, &Seeds { at, first: [&u_k, &nothing] });
                for i in 0..n {
                    values[k * n + i] = d[i].a;
                }
            }
        }

        fn time_derivative(&self, at: EvaluationPoint<'_>, values: &mut [f64]) {
            let time = |slot| f64::from(u8::from(slot == Slot::T));
            let d = evaluate(self.equations, &Seeds { at, first: [&time, &nothing] });
            for (value, d) in values.iter_mut().zip(d) {
                *value = d.a;
            }
        }

        fn outputs(&self, at: EvaluationPoint<'_>, w: &mut [f64]) {
            w.copy_from_slice(at.y);
        }

        fn output_jacobians(
            &self,
            at: EvaluationPoint<'_>,
            dwdy: &mut [f64],
            dwdu: &mut [f64],
            dwdp: &mut [f64],
            dwdt: &mut [f64],
        ) {
            let n = at.y.len();
            dwdy.fill(0.0);
            for i in 0..n {
                dwdy[i * n + i] = 1.0;
            }
            dwdu.fill(0.0);
            dwdp.fill(0.0);
            dwdt.fill(0.0);
        }

        fn output_sensitivities(
            &self,
            at: EvaluationPoint<'_>,
            s: &[f64],
            w: &mut [f64],
            dw: &mut [f64],
        ) {
            w.copy_from_slice(at.y);
            dw.copy_from_slice(s);
        }

        fn start(&self, at: EvaluationPoint<'_>, y: &mut [f64]) {
            (self.equations.start.0)(at.u, at.p, y);
        }

        fn start_sensitivities(&self, at: EvaluationPoint<'_>, s: &mut [f64]) {
            let n = self.signature.unknowns.len();
            for (j, s) in s.chunks_exact_mut(n).enumerate() {
                let zero = HyperDual::from(0.0);
                let (mut us, mut ps, mut y) = ([zero; MOST], [zero; MOST], [zero; MOST]);
                for (i, v) in at.u.iter().enumerate() {
                    us[i] = HyperDual::from(*v);
                }
                for (i, v) in at.p.iter().enumerate() {
                    ps[i] = HyperDual { a: f64::from(u8::from(i == j)), ..HyperDual::from(*v) };
                }
                (self.equations.start.1)(&us[..at.u.len()], &ps[..at.p.len()], &mut y[..n]);
                for i in 0..n {
                    s[i] = y[i].a;
                }
            }
        }
    };
}

impl<const N: usize, const NS: usize, const U: usize, const J: usize, const G: usize> System
    for Stacked<N, NS, U, J, G>
{
    type Vector = [f64; N];
    type Sensitivity = [f64; NS];
    type Inputs = [f64; U];
    type Jacobian = [f64; J];
    type SensitivityJacobian = [f64; G];
    system!();
}

impl System for Heaped {
    type Vector = Vec<f64>;
    type Sensitivity = Vec<f64>;
    type Inputs = Vec<f64>;
    type Jacobian = Vec<f64>;
    type SensitivityJacobian = Vec<f64>;
    system!();
}

impl<const N: usize, const NS: usize, const U: usize, const J: usize, const G: usize> SolvableSystem
    for Stacked<N, NS, U, J, G>
{
    type Factorisation = FixedLu<N>;

    fn integrate(
        problem: &Problem<'_, Self>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, Failure> {
        dgd_runtime::integrate::integrate(problem, times, options, wanted)
    }
}

impl SolvableSystem for Heaped {
    type Factorisation = AutoLu;

    fn integrate(
        problem: &Problem<'_, Self>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, Failure> {
        dgd_runtime::integrate::integrate(problem, times, options, wanted)
    }
}
