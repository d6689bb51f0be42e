//! A model of many unknowns, with a sparse Jacobian.

use dgd_runtime::linalg::AutoLu;
use dgd_runtime::{
    Direction, Discrete, EvaluationPoint, Failure, Inputs, METHODS, Options, Parameter, Pattern,
    Problem, Signature, Solution, SolvableSystem, System, Unit, Unknown, WantedResults, simulate,
    simulate_chosen, simulate_with_sensitivities,
};

/// Diffusion on a line between ends at zero, and an algebraic unknown beside each cell:
///
/// ```text
///   ẋᵢ = k (xᵢ₋₁ − 2 xᵢ + xᵢ₊₁),    0 = zᵢ² − k xᵢ² − 1
/// ```
///
/// Starting from the lowest mode, xᵢ = sin(π i/(m+1)) e^(−λ k t) with λ = 4 sin²(π / (2 (m+1))).
struct Diffusion {
    signature: Signature,
    cells: usize,
}

impl Diffusion {
    fn new(cells: usize) -> Self {
        let n = 2 * cells;
        let unit = Unit { symbol: "1".into(), factor: 1.0, offset: 0.0 };
        let mut jacobian = Vec::new();
        for i in 0..cells {
            for row in [i.wrapping_sub(1), i, i + 1] {
                if row < cells {
                    jacobian.push((row, i));
                }
            }
            jacobian.push((cells + i, i));
        }
        jacobian.extend((cells..n).map(|i| (i, i)));
        let pattern = Pattern::from_places;
        // Non-zeros of ∂g/∂y: for the cells the derivatives of J, which are those of ∂f/∂k; for z, its own.
        Self {
            cells,
            signature: Signature {
                name: "diffusion".into(),
                unknowns: (0..n)
                    .map(|i| Unknown {
                        name: format!("y{i}").into(),
                        unit: unit.clone(),
                        nominal: Some(1.0),
                        differential: i < cells,
                    })
                    .collect(),
                equations: (0..n).map(|i| format!("e{i}").into()).collect(),
                parameters: vec![Parameter {
                    name: "k".into(),
                    unit,
                    value: 1.0,
                    lower: 0.0,
                    upper: 1e3,
                    nominal: None,
                    log: false,
                    fixed: false,
                }]
                .into(),
                inputs: Vec::new().into(),
                delays: Vec::new().into(),
                varying_delays: Vec::new().into(),
                delayed_inputs: Vec::new().into(),
                delayed_unknowns: Vec::new().into(),
                differentiated_inputs: Vec::new().into(),
                outputs: Vec::new().into(),
                densities: Vec::new().into(),
                starts_at_rest: false,
                start_equations: Vec::new().into(),
                conserved: Vec::new().into(),
                directions: vec![Direction::Parameter(0)].into(),
                sensitivity_jacobian: pattern(&jacobian),
                jacobian: pattern(&jacobian),
                parameter_jacobian: pattern(&[]),
                input_jacobian: pattern(&[]),
                output_jacobians: [pattern(&[]), pattern(&[]), pattern(&[])],
                discrete: Discrete::NONE,
            },
        }
    }

    fn laplacian(&self, x: &[f64], i: usize) -> f64 {
        let at = |i: usize| if i < self.cells { x[i] } else { 0.0 };
        at(i.wrapping_sub(1)) - 2.0 * x[i] + at(i + 1)
    }

    /// Non-zeros of the Jacobian from those of a cell's own column.
    fn fill(
        &self,
        values: &mut [f64],
        k: f64,
        cell: impl Fn(usize) -> f64,
        algebraic: impl Fn(usize) -> f64,
    ) {
        let m = self.cells;
        let pattern = &self.signature.jacobian;
        for ((row, column), value) in pattern.positions().zip(values) {
            *value = match (row < m, column < m) {
                (true, _) if row == column => -2.0 * k,
                (true, _) => k,
                (false, true) => cell(column),
                (false, false) => algebraic(column - m),
            };
        }
    }
}

impl SolvableSystem for Diffusion {
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

impl System for Diffusion {
    type Vector = Vec<f64>;
    type Sensitivity = Vec<f64>;
    type Inputs = Vec<f64>;
    type Jacobian = Vec<f64>;
    type SensitivityJacobian = Vec<f64>;

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn rhs(&self, at: EvaluationPoint<'_>, f: &mut [f64]) {
        let (x, z) = at.y.split_at(self.cells);
        for i in 0..self.cells {
            f[i] = at.p[0] * self.laplacian(x, i);
            f[self.cells + i] = z[i] * z[i] - at.p[0] * x[i] * x[i] - 1.0;
        }
    }

    fn linearize(
        &self,
        at: EvaluationPoint<'_>,
        _: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
    ) {
        self.rhs(at, f);
        let (x, z) = at.y.split_at(self.cells);
        let k = at.p[0];
        self.fill(jacobian, k, |i| -2.0 * k * x[i], |i| 2.0 * z[i]);
        dfdt.fill(0.0);
    }

    fn sensitivity_rhs(&self, at: EvaluationPoint<'_>, s: &[f64], f: &mut [f64], g: &mut [f64]) {
        self.rhs(at, f);
        let (x, z) = at.y.split_at(self.cells);
        let (sx, sz) = s.split_at(self.cells);
        let k = at.p[0];
        for i in 0..self.cells {
            g[i] = k * self.laplacian(sx, i) + self.laplacian(x, i);
            g[self.cells + i] = 2.0 * z[i] * sz[i] - 2.0 * k * x[i] * sx[i] - x[i] * x[i];
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
        self.linearize(at, udot, f, jacobian, dfdt);
        self.sensitivity_rhs(at, s, f, g);
        let x = &at.y[..self.cells];
        let (sx, sz) = s.split_at(self.cells);
        let k = at.p[0];
        self.fill(dgdy, 1.0, |i| -2.0 * k * sx[i] - 2.0 * x[i], |i| 2.0 * sz[i]);
        dgdt.fill(0.0);
    }

    fn parameter_jacobian(&self, _: EvaluationPoint<'_>, _: &mut [f64]) {}

    fn input_jacobian(&self, _: EvaluationPoint<'_>, _: &mut [f64]) {}

    fn time_derivative(&self, _: EvaluationPoint<'_>, values: &mut [f64]) {
        values.fill(0.0);
    }

    fn outputs(&self, _: EvaluationPoint<'_>, _: &mut [f64]) {}

    fn output_jacobians(
        &self,
        _: EvaluationPoint<'_>,
        _: &mut [f64],
        _: &mut [f64],
        _: &mut [f64],
        _: &mut [f64],
    ) {
    }

    fn output_sensitivities(
        &self,
        _: EvaluationPoint<'_>,
        _: &[f64],
        _: &mut [f64],
        _: &mut [f64],
    ) {
    }

    fn start(&self, _: EvaluationPoint<'_>, y: &mut [f64]) {
        let (x, z) = y.split_at_mut(self.cells);
        for (i, x) in x.iter_mut().enumerate() {
            *x = mode(i, self.cells);
        }
        z.fill(1.0);
    }

    fn start_sensitivities(&self, _: EvaluationPoint<'_>, s: &mut [f64]) {
        s.fill(0.0);
    }
}

fn mode(i: usize, cells: usize) -> f64 {
    (std::f64::consts::PI * (i + 1) as f64 / (cells + 1) as f64).sin()
}

#[test]
fn ten_thousand_unknowns() {
    let cells = 5000;
    let system = Diffusion::new(cells);
    let inputs = Inputs::none();
    let p = [1.0];
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let tolerance = 1e-6;
    let half = std::f64::consts::PI / (2.0 * (cells + 1) as f64);
    let lambda = 4.0 * half.sin() * half.sin();
    // One time constant of the mode.
    let t = 1.0 / lambda;
    let implicit = METHODS.iter().filter(|m| m.kind.is_implicit());
    for method in implicit {
        let options = Options { rtol: tolerance, atol: tolerance, method, ..Options::default() };
        let solution = simulate_with_sensitivities(&problem, &[0.0, t], &options).unwrap();
        verify(&solution, cells, p[0], lambda * t, tolerance);
    }
}

// Without the feature, a matrix without a narrow band is treated as one with a wide band.
#[cfg(feature = "sparse")]
#[test]
fn the_choice_goes_by_size_by_algebraic_unknowns_and_by_the_pattern() {
    use std::collections::BTreeSet;

    use dgd_runtime::automatic_method;

    let chosen = |cells, all_differential: bool, is_band: bool| {
        let Diffusion { mut signature, .. } = Diffusion::new(cells);
        if all_differential {
            let unknowns = signature.unknowns.iter();
            signature.unknowns = unknowns.map(|x| Unknown { differential: true, ..x }).collect();
        }
        if !is_band {
            // 7919 is a prime: each row reads distant unknowns.
            let n = 2 * cells;
            let places = (1..4).flat_map(|k| (0..n).map(move |i| (i, i * i * k * 7919 % n)));
            signature.jacobian = Pattern::from_places(
                &places.collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>(),
            );
        }
        automatic_method(&signature).name
    };
    assert_eq!(chosen(500, true, false), "rodas5p");
    assert_eq!(chosen(501, true, false), "bdf");
    assert_eq!(chosen(501, true, true), "rodas5p");
    assert_eq!(chosen(501, false, false), "rodas5p");
}

/// The same polynomials are evaluated for some unknowns or for all.
#[test]
fn chosen_unknowns_are_those_of_all() {
    let system = Diffusion::new(60);
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &[1.0], inputs: &inputs, start: &[] };
    let times: Vec<f64> = (0..30).map(|k| f64::from(k * k)).collect();
    let chosen = [119, 3, 60];
    for method in METHODS.iter().filter(|m| m.kind.is_implicit()) {
        let options = Options { method, ..Options::default() };
        let all = simulate(&problem, &times, &options).unwrap();
        let some = simulate_chosen(&problem, &chosen, &times, &options).unwrap();
        assert_eq!((some.n, &some.times, some.statistics), (3, &all.times, all.statistics));
        for k in 0..times.len() {
            for (value, i) in some.y(k).iter().zip(chosen) {
                // A few dozen terms below 10 are added up.
                let rounding = 400.0 * f64::EPSILON;
                assert!((value - all.y(k)[i]).abs() <= rounding, "{} {k} {i}", method.name);
            }
        }
    }
}

/// Allows a small multiple of the tolerance.
fn verify(solution: &Solution, cells: usize, k: f64, lambda_t: f64, tolerance: f64) {
    let decay = (-k * lambda_t).exp();
    for i in (0..cells).step_by(137) {
        let x = mode(i, cells) * decay;
        let dx = -lambda_t * x;
        let z = (k * x * x + 1.0).sqrt();
        let dz = (x * x + 2.0 * k * x * dx) / (2.0 * z);
        for (computed, exact) in [
            (solution.y(1)[i], x),
            (solution.y(1)[cells + i], z),
            (solution.s(1)[i], dx),
            (solution.s(1)[cells + i], dz),
        ] {
            assert!((computed - exact).abs() <= 20.0 * tolerance, "{i}: {computed} {exact}");
        }
    }
}
