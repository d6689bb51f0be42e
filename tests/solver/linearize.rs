//! Linear models against differences of the equations themselves, for models of every kind.

use std::path::Path;

use dgd_execute::LoadedSystem;
use dgd_runtime::linearize::{
    DMatrix, LinearInput, OperatingPoint, StateSpace, linearize, steady_state,
};
use dgd_runtime::{EvaluationPoint, InputColumn, Inputs, Options, Problem, System, Unit};

use crate::support::compiled;

/// A model, its variants, its inputs at 0 s and at 1000 s in declared units, and where it is linearised.
type Case = (&'static str, &'static [(&'static str, &'static str)], &'static [[f64; 2]], f64);

/// Away from kinks, in the middle of something going on.
const CASES: [Case; 17] = [
    ("models/mud_circulation.dgd", &[], &[[50.0, 52.0], [1800.0, 1900.0], [290.0, 290.0]], 60.0),
    (
        "models/mud_circulation.dgd",
        &[("flow", "static")],
        &[[50.0, 52.0], [1800.0, 1900.0], [290.0, 290.0]],
        60.0,
    ),
    ("models/cstr.dgd", &[], &[[100.0, 100.0], [27.0, 30.0]], 100.0),
    ("models/controlled_level.dgd", &[], &[[8.0, 8.0]], 40.0),
    ("models/delayed_sensor.dgd", &[], &[[300.0, 500.0], [20.0, 20.0]], 30.0),
    ("models/pendulum.dgd", &[], &[[1.0, 2.0]], 2.0),
    ("models/pendulum_cartesian.dgd", &[], &[], 0.2),
    ("models/pendulum_cartesian.dgd", &[], &[], 1.1),
    ("models/pump_speed_step.dgd", &[], &[[9.0, 9.0], [0.02, 0.02]], 100.0),
    ("models/rc_circuit.dgd", &[], &[[5.0, 9.0]], 1e-4),
    ("models/remote_level.dgd", &[], &[[300.0, 340.0]], 45.0),
    ("models/rigid_tanks.dgd", &[], &[[300.0, 500.0], [0.0, 7.0]], 20.0),
    ("models/robertson.dgd", &[], &[], 10.0),
    // The weir overflows at first; the drain is open later on.
    ("models/tank_with_weir.dgd", &[], &[[9.0, 9.0]], 500.0),
    ("models/tank_with_weir.dgd", &[], &[[9.0, 1.0]], 900.0),
    ("models/transmission_line.dgd", &[], &[[1.0, 3.0], [0.0, 1.0]], 0.7),
    ("models/test_set/transistor_amplifier.dgd", &[], &[], 0.02),
];

fn recorded(system: &LoadedSystem, values: &[[f64; 2]]) -> Inputs {
    let signature = system.signature();
    assert_eq!(values.len(), signature.inputs.len(), "inputs of {}", signature.name);
    let si = |value: f64, unit: &Unit| value * unit.factor + unit.offset;
    let values: Vec<Vec<f64>> = (signature.inputs.iter().zip(values))
        .map(|(input, values)| values.iter().map(|value| si(*value, &input.unit)).collect())
        .collect();
    let columns: Vec<InputColumn<'_>> = (signature.inputs.iter().zip(&values))
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    Inputs::recorded(&[0.0, 1000.0], &columns).expect("two samples")
}

/// Moves unknowns and inputs by so much.
type Move<'a> = dyn Fn(f64, &mut [f64], &mut [f64]) + 'a;

/// The model's equations close to a point, algebraic unknowns solved for: no derivative of the compiler
/// is used.
struct Equations<'a> {
    system: &'a LoadedSystem,
    p: &'a [f64],
    at: &'a OperatingPoint,
    states: &'a [usize],
    others: &'a [usize],
    sizes: Vec<f64>,
}

impl Equations<'_> {
    /// ẋ and w, with the unknowns y as a guess for those that are not states.
    fn slopes_and_outputs(&self, mut y: Vec<f64>, u: &[f64]) -> Vec<f64> {
        let signature = self.system.signature();
        let mut u = u.to_vec();
        let mut delays = vec![0.0; signature.varying_delays.len()];
        let mut before = delays.clone();
        self.system.varying_delays(self.at.point(self.p), &mut before);
        self.system
            .varying_delays(EvaluationPoint { y: &y, u: &u, ..self.at.point(self.p) }, &mut delays);
        let past = signature.past();
        for (k, late) in signature.delayed_unknowns.iter().enumerate().filter(|(_, x)| x.varies) {
            // x(t − τ) as τ moves, along its slope there.
            let moved = delays[late.delay] - before[late.delay];
            u[past.first + past.n_v + k] -= u[past.first + 2 * past.n_v + k] * moved;
        }
        let rhs = |y: &[f64]| {
            let mut f = vec![0.0; y.len()];
            self.system.rhs(EvaluationPoint { y, u: &u, ..self.at.point(self.p) }, &mut f);
            f
        };
        // Newton with differences, from a guess that is off by a small step.
        let m = self.others.len();
        for _ in 0..if m == 0 { 0 } else { 6 } {
            let f = rhs(&y);
            let mut slopes = DMatrix::zeros(m, m);
            for (j, &column) in self.others.iter().enumerate() {
                let step = 1e-6 * self.sizes[column];
                let mut moved = y.clone();
                moved[column] += step;
                let ahead = rhs(&moved);
                moved[column] -= 2.0 * step;
                let behind = rhs(&moved);
                for (i, &row) in self.others.iter().enumerate() {
                    slopes[(i, j)] = (ahead[row] - behind[row]) / (2.0 * step);
                }
            }
            let rest = DMatrix::from_fn(m, 1, |i, _| -f[self.others[i]]);
            let correction = slopes.lu().solve(&rest).expect("index 1");
            for (i, &row) in self.others.iter().enumerate() {
                y[row] += correction[(i, 0)];
            }
        }
        let f = rhs(&y);
        let mut all: Vec<f64> = self.states.iter().map(|i| f[*i]).collect();
        let mut w = vec![0.0; signature.outputs.len()];
        self.system.outputs(EvaluationPoint { y: &y, u: &u, ..self.at.point(self.p) }, &mut w);
        all.extend(w);
        all
    }

    /// The derivative to what `moved` moves by so much, from differences over h and h/2: what is left
    /// is of the order of h⁴.
    fn derivative(&self, h: f64, moved: impl Fn(f64, &mut [f64], &mut [f64])) -> Vec<f64> {
        let at = |by: f64| {
            let (mut y, mut u) = (self.at.y.clone(), self.at.u.clone());
            moved(by, &mut y, &mut u);
            self.slopes_and_outputs(y, &u)
        };
        let difference = |h: f64| -> Vec<f64> {
            at(h).iter().zip(&at(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
        };
        let (wide, narrow) = (difference(h), difference(h / 2.0));
        narrow.iter().zip(&wide).map(|(narrow, wide)| (4.0 * narrow - wide) / 3.0).collect()
    }
}

/// [A B A₁; C D C₁], columns times the sizes of what they are about.
fn whole(system: &StateSpace, sizes: &[f64]) -> DMatrix<f64> {
    let (n, m) = (system.a.ncols(), system.b.ncols());
    let (top, bottom) = (system.a.nrows(), system.c.nrows());
    DMatrix::from_fn(top + bottom, n + m + system.delayed_a.ncols(), |i, j| {
        let [x, u, v] = if i < top {
            [&system.a, &system.b, &system.delayed_a]
        } else {
            [&system.c, &system.d, &system.delayed_c]
        };
        let i = if i < top { i } else { i - top };
        let entry = if j < n {
            x[(i, j)]
        } else if j < n + m {
            u[(i, j - n)]
        } else {
            v[(i, j - n - m)]
        };
        entry * sizes[j]
    })
}

#[test]
fn matrices_are_differences_of_the_equations() {
    for (file, variants, inputs, t) in CASES {
        let loaded = LoadedSystem::new(compiled(Path::new(file), variants).program);
        let signature = loaded.signature();
        let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
        let inputs = recorded(&loaded, inputs);
        let problem = Problem { system: &loaded, p: &p, inputs: &inputs, start: &[] };
        let options = Options { rtol: 1e-8, atol: 1e-8, ..Options::default() };
        let at = OperatingPoint::reached(&problem, 0.0, t, &options)
            .unwrap_or_else(|error| panic!("{file}: {error}"));
        let linear = linearize(&problem, &at).unwrap_or_else(|error| panic!("{file}: {error}"));

        let size = |value: f64, nominal: Option<f64>, unit: &Unit| {
            let size = nominal.unwrap_or(0.0).abs().max(value.abs());
            if size > 0.0 { size } else { unit.factor }
        };
        let sizes: Vec<f64> = (signature.unknowns.iter().zip(&at.y))
            .map(|(unknown, y)| size(*y, unknown.nominal, &unknown.unit))
            .collect();
        let equations = Equations {
            system: &loaded,
            p: &p,
            at: &at,
            states: &linear.states,
            others: &linear.eliminated,
            sizes: sizes.clone(),
        };
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut column_sizes = Vec::new();
        let mut add = |size: f64, moved: &Move<'_>| {
            column_sizes.push(size);
            let derivative = equations.derivative(1e-5 * size, moved);
            columns.push(derivative.into_iter().map(|value| value * size).collect());
        };
        for &i in &linear.states {
            add(sizes[i], &|by, y, _| y[i] += by);
        }
        let (n_in, n_late) = (signature.inputs.len(), signature.delayed_inputs.len());
        let mut tau = vec![0.0; signature.delays.len()];
        loaded.delays(at.point(&p), &mut tau);
        for channel in &linear.channels {
            let among = || signature.delayed_inputs.iter().enumerate();
            let places: Vec<usize> = match *channel {
                LinearInput::Input(input) => std::iter::once(input)
                    .chain(among().filter_map(|(k, late)| {
                        (late.input == input && tau[late.delay] == 0.0).then_some(n_in + k)
                    }))
                    .collect(),
                LinearInput::Delayed { input, tau: by } | LinearInput::Slope { input, tau: by } => {
                    among()
                        .filter(|(_, late)| late.input == input && tau[late.delay] == by)
                        .map(|(k, _)| match channel {
                            LinearInput::Slope { .. } => n_in + n_late + k,
                            _ => n_in + k,
                        })
                        .collect()
                }
            };
            assert!(!places.is_empty(), "{file}: {channel:?}");
            let input = &signature.inputs[channel.input()];
            add(size(at.u[places[0]], None, &input.unit), &|by, _, u| {
                for place in &places {
                    u[*place] += by;
                }
            });
        }
        let past = signature.past();
        let mut found = 0;
        for (k, late) in signature.delayed_unknowns.iter().enumerate() {
            let place = past.first + past.n_v + k;
            if linear.delayed_unknowns.get(found).is_some_and(|known| known.unknown == late.unknown)
            {
                found += 1;
                add(sizes[late.unknown], &|by, _, u| u[place] += by);
            }
        }
        assert_eq!(found, linear.delayed_unknowns.len(), "{file}");

        let whole = whole(&linear, &column_sizes);
        for i in 0..whole.nrows() {
            // Rounding of the equation, over the step, and what Richardson's rule leaves.
            let value = if i < linear.rates.len() { linear.rates[i] } else { 0.0 };
            let scale = columns.iter().fold(value.abs(), |scale, c| scale.max(c[i].abs()));
            for (j, column) in columns.iter().enumerate() {
                let apart = (whole[(i, j)] - column[i]).abs();
                assert!(
                    apart <= 1e-7 * scale,
                    "{file} at {t}: row {i}, column {j}: {} and {}",
                    whole[(i, j)],
                    column[i]
                );
            }
        }
    }
}

/// At rest nothing moves, and a run that starts there stays.
#[test]
fn steady_states_are_where_runs_stay() {
    let rests: [Case; 6] = [
        ("models/mud_circulation.dgd", &[], &[[50.0; 2], [1800.0; 2], [290.0; 2]], 1e4),
        (
            "models/mud_circulation.dgd",
            &[("flow", "static")],
            &[[50.0; 2], [1800.0; 2], [290.0; 2]],
            1e4,
        ),
        ("models/controlled_level.dgd", &[], &[[8.0; 2]], 1e3),
        ("models/delayed_sensor.dgd", &[], &[[300.0; 2], [20.0; 2]], 1e3),
        ("models/remote_level.dgd", &[], &[[300.0; 2]], 1e3),
        ("models/rigid_tanks.dgd", &[], &[[300.0; 2], [0.5; 2]], 1e3),
    ];
    for (file, variants, inputs, long) in rests {
        let loaded = LoadedSystem::new(compiled(Path::new(file), variants).program);
        let signature = loaded.signature();
        let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
        let inputs = recorded(&loaded, inputs);
        let problem = Problem { system: &loaded, p: &p, inputs: &inputs, start: &[] };
        let options = Options { rtol: 1e-9, atol: 1e-9, ..Options::default() };
        let at =
            steady_state(&problem, 0.0, &options).unwrap_or_else(|error| panic!("{file}: {error}"));
        let start: Vec<(usize, f64)> = at.y.iter().copied().enumerate().collect();
        let there = Problem { start: &start, ..problem };
        let solution = dgd_runtime::simulate(&there, &[0.0, long.min(1000.0)], &options)
            .unwrap_or_else(|failure| panic!("{file}: {failure}"));
        for (i, unknown) in signature.unknowns.iter().enumerate() {
            let size = at.y[i].abs().max(unknown.nominal.unwrap_or(unknown.unit.factor).abs());
            let apart = (solution.y(1)[i] - at.y[i]).abs();
            // The tolerance, many times over as runs are long.
            assert!(apart <= 1e-7 * size, "{file}: `{}` moves by {apart}", unknown.name);
        }
    }
}
