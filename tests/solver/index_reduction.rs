//! Models of an index above 1, against formulations of the same without constraints.

use std::fmt::Write as _;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Options, Problem, Solution, System, consistent_start,
    simulate, simulate_with_sensitivities,
};

/// The relative tolerance of the runs, and how well two formulations agree: an error of up to the
/// tolerance in each of some hundred steps, grown by what the sensitivities of these motions grow.
const RTOL: f64 = 1e-10;
const CLOSE: f64 = 3e-7;

fn options() -> Options {
    Options { rtol: RTOL, atol: RTOL, ..Options::default() }
}

fn model(text: &str) -> InterpretedSystem {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "model.dgd".to_owned(), text: format!("model m\n{text}") };
    let mut read = |_: &str| Err("no imports".to_owned());
    let options = ModelOptions::default();
    let compiled = compile(
        main,
        &options,
        &SensitivityDirections::All,
        &mut read,
        &mut sources,
        &mut diagnostics,
    );
    let compiled = compiled.unwrap_or_else(|_| {
        let shown = render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain);
        panic!("{shown}")
    });
    InterpretedSystem::new(compiled.program)
}

fn parameters(system: &InterpretedSystem) -> Vec<f64> {
    system.signature().parameters.iter().map(|parameter| parameter.value).collect()
}

fn run(system: &InterpretedSystem, times: &[f64]) -> Solution {
    let (p, inputs) = (parameters(system), Inputs::none());
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate_with_sensitivities(&problem, times, &options()).expect("a solution");
    assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);
    solution
}

fn position(system: &InterpretedSystem, unknown: &str) -> usize {
    let unknowns = &system.signature().unknowns;
    unknowns.iter().position(|u| u.name == unknown).expect("an unknown")
}

fn values(system: &InterpretedSystem, solution: &Solution, unknown: &str) -> Vec<f64> {
    let i = position(system, unknown);
    (0..solution.times.len()).map(|k| solution.y(k)[i]).collect()
}

/// Sensitivities of an unknown to the j-th parameter.
fn slopes(system: &InterpretedSystem, solution: &Solution, unknown: &str, j: usize) -> Vec<f64> {
    let i = position(system, unknown);
    (0..solution.times.len()).map(|k| solution.s(k)[j * solution.n + i]).collect()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64]) {
    let largest = expected.iter().fold(1.0_f64, |largest, x| largest.max(x.abs()));
    for (k, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= CLOSE * largest, "number {k}: {f} is not {e}");
    }
}

fn every(step: f64, until: f64) -> Vec<f64> {
    let n = (until / step).round() as usize;
    (0..=n).map(|k| until * k as f64 / n as f64).collect()
}

const ROD: &str = "
parameter g [m/s^2] = 9.81
parameter l [m] = 1.5
parameter theta_0 [rad] = THETA
parameter omega_0 [rad/s] = OMEGA
";

/// The rod in Cartesian coordinates and by its angle.
fn rods(theta: f64, omega: f64) -> [InterpretedSystem; 2] {
    let head = ROD.replace("THETA", &theta.to_string()).replace("OMEGA", &omega.to_string());
    let cartesian = model(&format!(
        "{head}
        state x [m] = l*sin(theta_0)
        state y [m] = -l*cos(theta_0)
        state v_x [m/s] = l*omega_0*cos(theta_0)
        state v_y [m/s] = l*omega_0*sin(theta_0)
        unknown tension [1/s^2] = 1
        equation right: der(x) = v_x
        equation up: der(y) = v_y
        equation force_x: der(v_x) = -tension*x
        equation force_y: der(v_y) = -tension*y - g
        equation rod: x^2 + y^2 = l^2
        "
    ));
    let angle = model(&format!(
        "{head}
        state theta [rad] = theta_0
        state omega [rad/s] = omega_0
        equation angle: der(theta) = omega
        equation pivot: der(omega) = -g/l*sin(theta)
        "
    ));
    [cartesian, angle]
}

/// Position and sensitivities of the Cartesian rod are those of the angle: x = l sin θ.
fn check_rod(theta: f64, omega: f64, times: &[f64]) {
    let [cartesian, angle] = rods(theta, omega);
    let (found, expected) = (run(&cartesian, times), run(&angle, times));
    let thetas = values(&angle, &expected, "theta");
    let l = 1.5;
    let x: Vec<f64> = thetas.iter().map(|theta| l * theta.sin()).collect();
    let y: Vec<f64> = thetas.iter().map(|theta| -l * theta.cos()).collect();
    assert_close(&values(&cartesian, &found, "x"), &x);
    assert_close(&values(&cartesian, &found, "y"), &y);
    // T = ω² + g cos θ/l
    let omegas = values(&angle, &expected, "omega").into_iter().zip(&thetas);
    let tension: Vec<f64> = omegas.map(|(omega, t)| omega * omega + 9.81 / l * t.cos()).collect();
    assert_close(&values(&cartesian, &found, "tension"), &tension);
    for j in 0..4 {
        let dtheta = slopes(&angle, &expected, "theta", j);
        let own = if j == 1 { 1.0 } else { 0.0 };
        let along = thetas.iter().zip(&dtheta);
        let dx: Vec<f64> = along.clone().map(|(t, d)| own * t.sin() + l * t.cos() * d).collect();
        let dy: Vec<f64> = along.map(|(t, d)| -own * t.cos() + l * t.sin() * d).collect();
        assert_close(&slopes(&cartesian, &found, "x", j), &dx);
        assert_close(&slopes(&cartesian, &found, "y", j), &dy);
    }
}

#[test]
fn a_pendulum_swings_as_its_angle_says() {
    check_rod(0.3, 0.0, &every(0.25, 10.0));
    check_rod(2.5, 0.0, &every(0.25, 10.0));
}

#[test]
fn a_pendulum_turns_over_as_its_angle_says() {
    // With (l ω)²/2 = 91 m²/s² at the bottom, more than the 2 g l = 29 m²/s² of the top.
    check_rod(0.1, 9.0, &every(0.25, 10.0));
}

#[test]
fn two_rods_move_as_their_angles_say() {
    let head = "
        parameter g [m/s^2] = 9.81
        parameter l [m] = 1.5
        parameter k [m] = 0.8
    ";
    let cartesian = model(&format!(
        "{head}
        state x [m] = l
        state y [m] = 0
        state u [m/s] = 0
        state v [m/s] = 0
        state x2 [m] = l
        state y2 [m] = k
        state u2 [m/s] = 0
        state v2 [m/s] = 0
        unknown t1 [1/s^2] = 1
        unknown t2 [1/s^2] = 1
        equation a: der(x) = u
        equation b: der(y) = v
        equation c: der(x2) = u2
        equation d: der(y2) = v2
        equation e: der(u) = -t1*x + t2*(x2 - x)
        equation f: der(v) = -t1*y + t2*(y2 - y) - g
        equation h: der(u2) = -t2*(x2 - x)
        equation i: der(v2) = -t2*(y2 - y) - g
        equation upper: x^2 + y^2 = l^2
        equation lower: (x2 - x)^2 + (y2 - y)^2 = k^2
        "
    ));
    let names: Vec<&str> =
        cartesian.signature().discrete.automata.iter().map(|a| &*a.name).collect();
    assert_eq!(names, ["states of upper", "states of lower"]);
    // Equal masses, from Lagrange's equations, with a and b the angles from the vertical.
    let angles = model(&format!(
        "{head}
        state a [rad] = pi/2
        state b [rad] = pi
        state p [rad/s] = 0
        state q [rad/s] = 0
        equation turn_a: der(a) = p
        equation turn_b: der(b) = q
        equation upper: 2*l*der(p) + k*der(q)*cos(a - b) + k*q^2*sin(a - b) + 2*g*sin(a) = 0 [m/s^2]
        equation lower: k*der(q) + l*der(p)*cos(a - b) - l*p^2*sin(a - b) + g*sin(b) = 0 [m/s^2]
        "
    ));
    let times = every(0.1, 2.0);
    let (found, expected) = (run(&cartesian, &times), run(&angles, &times));
    let (a, b) = (values(&angles, &expected, "a"), values(&angles, &expected, "b"));
    let both = a.iter().zip(&b);
    let x2: Vec<f64> = both.clone().map(|(a, b)| 1.5 * a.sin() + 0.8 * b.sin()).collect();
    let y2: Vec<f64> = both.map(|(a, b)| -1.5 * a.cos() - 0.8 * b.cos()).collect();
    assert_close(&values(&cartesian, &found, "x2"), &x2);
    assert_close(&values(&cartesian, &found, "y2"), &y2);
    // ∂x₂/∂g and ∂x₂/∂k
    for (j, own) in [(0, 0.0), (2, 1.0)] {
        let (da, db) = (slopes(&angles, &expected, "a", j), slopes(&angles, &expected, "b", j));
        let dx2: Vec<f64> = (0..times.len())
            .map(|i| 1.5 * a[i].cos() * da[i] + 0.8 * b[i].cos() * db[i] + own * b[i].sin())
            .collect();
        assert_close(&slopes(&cartesian, &found, "x2", j), &dx2);
    }
}

#[test]
fn levels_of_tanks_in_rigid_connection_move_together() {
    let system = model(
        "
        parameter A_1 [m^2] = 2
        parameter A_2 [m^2] = 3
        parameter q_in [m^3/s] = 0.1
        state h_1 [m] = 1
        state h_2 [m] = 4
        unknown q [m^3/s] = 0
        equation first: A_1*der(h_1) = q_in - q
        equation second: A_2*der(h_2) = q
        equation connection: h_1 = h_2
        ",
    );
    assert!(system.signature().discrete.is_empty(), "one choice of states holds everywhere");
    let times = every(1.0, 10.0);
    let solution = run(&system, &times);
    // The start value of h_2 is a guess: h = 1 + q_in t/(A₁ + A₂), q = A₂ q_in/(A₁ + A₂).
    let h: Vec<f64> = times.iter().map(|t| 1.0 + 0.1 * t / 5.0).collect();
    assert_close(&values(&system, &solution, "h_1"), &h);
    assert_close(&values(&system, &solution, "h_2"), &h);
    assert_close(&values(&system, &solution, "q"), &vec![0.06; times.len()]);
    let by_area: Vec<f64> = times.iter().map(|t| -0.1 * t / 25.0).collect();
    assert_close(&slopes(&system, &solution, "h_2", 0), &by_area);
    let flow_by_area = vec![-0.3 / 25.0; times.len()];
    assert_close(&slopes(&system, &solution, "q", 0), &flow_by_area);
}

#[test]
fn capacitors_in_a_loop_share_their_charge() {
    // A source drives C₁ in parallel with C₂ and C₃ in series.
    let system = model(
        "
        parameter C_1 [F] = 1e-12
        parameter C_2 [F] = 2e-12
        parameter C_3 [F] = 6e-12
        parameter i_s [A] = 1e-9
        state v_1 [V] = 0 nominal 1
        state v_2 [V] = 0 nominal 1
        state v_3 [V] = 0 nominal 1
        unknown i [A] = 0 nominal 1e-9
        equation first: C_1*der(v_1) = i_s - i
        equation second: C_2*der(v_2) = i
        equation third: C_3*der(v_3) = i
        equation loop: v_1 = v_2 + v_3
        ",
    );
    assert!(system.signature().discrete.is_empty());
    let times = every(1e-4, 1e-3);
    let solution = run(&system, &times);
    // C₂ and C₃ in series are 1.5 pF: dv₁/dt = i_s/(2.5 pF), i = 0.6 i_s.
    let v: Vec<f64> = times.iter().map(|t| 400.0 * t).collect();
    assert_close(&values(&system, &solution, "v_1"), &v);
    let currents: Vec<f64> = values(&system, &solution, "i").into_iter().map(|i| i * 1e9).collect();
    assert_close(&currents, &vec![0.6; times.len()]);
}

/// The transistor amplifier of the Test Set for IVP Solvers (F. Mazzia and C. Magherini, release
/// 2.4, 2008), its eight rows as published; end values from there.
const AMPLIFIER: &str = "
constant U_b [V] = 6
constant U_F [V] = 0.026
constant alpha = 0.99
constant beta [A] = 1e-6
constant R_0 [ohm] = 1000
constant R [ohm] = 9000
constant C_1 [F] = 1e-6
constant C_2 [F] = 2e-6
constant C_3 [F] = 3e-6
constant C_4 [F] = 4e-6
constant C_5 [F] = 5e-6
function g(v [V]) = beta*(exp(v/U_F) - 1)
let U_e = 0.1 [V] * sin(200*pi*time/1 [s])
state y1 [V] = 0
state y2 [V] = 3
state y3 [V] = 3
state y4 [V] = 6
state y5 [V] = 3
state y6 [V] = 3
state y7 [V] = 6
state y8 [V] = 0
equation e1: C_1*(der(y2) - der(y1)) = (y1 - U_e)/R_0
equation e2: C_1*(der(y1) - der(y2)) = y2/R + (y2 - U_b)/R + (1 - alpha)*g(y2 - y3)
equation e3: -C_2*der(y3) = y3/R - g(y2 - y3)
equation e4: C_3*(der(y5) - der(y4)) = (y4 - U_b)/R + alpha*g(y2 - y3)
equation e5: C_3*(der(y4) - der(y5)) = y5/R + (y5 - U_b)/R + (1 - alpha)*g(y5 - y6)
equation e6: -C_4*der(y6) = y6/R - g(y5 - y6)
equation e7: C_5*(der(y8) - der(y7)) = (y7 - U_b)/R + alpha*g(y5 - y6)
equation e8: C_5*(der(y7) - der(y8)) = y8/R
";

const AMPLIFIER_END: [f64; 8] = [
    -0.556_214_501_226_270_9e-2,
    0.300_652_247_190_304_2e1,
    0.284_995_878_860_812_8e1,
    0.292_642_253_620_624_1e1,
    0.270_461_786_501_055_4e1,
    0.276_183_777_839_314_5e1,
    0.477_092_763_161_677_2e1,
    0.123_699_586_809_154_8e1,
];

#[test]
fn the_transistor_amplifier_comes_to_its_end_values() {
    let system = model(AMPLIFIER);
    let (p, inputs) = (Vec::new(), Inputs::none());
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let options = Options { rtol: tolerance, atol: tolerance, ..Options::default() };
        let solution = simulate(&problem, &[0.0, 0.2], &options).expect("a solution");
        for (i, end) in AMPLIFIER_END.iter().enumerate() {
            let error = (solution.y(1)[i] - end).abs();
            assert!(error <= 10.0 * tolerance * (end.abs() + 1.0), "y{} at {tolerance}", i + 1);
        }
    }
}

#[test]
fn a_prescribed_path_gives_its_own_slope() {
    let system = model(
        "
        input path [m] linear
        state x [m] = 0
        unknown v [m/s] = 0
        equation motion: der(x) = v
        equation track: x = path
        ",
    );
    let column = InputColumn {
        name: "path",
        interpolation: Interpolation::Linear,
        values: &[1.0, 4.0, 3.0],
    };
    let inputs = Inputs::recorded(&[0.0, 2.0, 4.0], &[column]).expect("inputs");
    let problem = Problem { system: &system, p: &[], inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &[0.0, 1.0, 3.0], &options()).expect("a solution");
    assert_close(&values(&system, &solution, "x"), &[1.0, 2.5, 3.5]);
    assert_close(&values(&system, &solution, "v"), &[1.5, 1.5, -0.5]);

    // A path that jumps would need an infinite speed.
    let column = InputColumn {
        name: "path",
        interpolation: Interpolation::Linear,
        values: &[1.0, 4.0, 3.0, 0.0],
    };
    let inputs = Inputs::recorded(&[0.0, 2.0, 2.0, 4.0], &[column]).expect("inputs");
    let problem = Problem { system: &system, p: &[], inputs: &inputs, start: &[] };
    let failure = simulate(&problem, &[0.0, 1.0, 3.0], &options()).expect_err("a jump");
    let expected = "input `path` jumps at t = 2 s, but `track` ties states to it, which cannot \
                    follow at once";
    assert_eq!(failure.to_string(), expected);
}

fn start_of(system: &InterpretedSystem, start: &[(usize, f64)]) -> Result<Vec<f64>, String> {
    let (p, inputs) = (parameters(system), Inputs::none());
    let problem = Problem { system, p: &p, inputs: &inputs, start };
    let found = consistent_start(&problem, 0.0, &options()).map_err(|error| error.to_string())?;
    Ok(found.y)
}

#[test]
fn start_values_that_are_not_free_are_guesses() {
    let [system, _] = rods(0.3, 0.0);
    let [x, y, v_x, v_y] = ["x", "y", "v_x", "v_y"].map(|name| position(&system, name));
    // Hanging, x is free: y and v_y follow on the side of their guesses.
    let found = start_of(&system, &[(x, 0.9), (y, -2.0), (v_x, 0.4), (v_y, 7.0)]).expect("a start");
    assert_close(&[found[x], found[y], found[v_x], found[v_y]], &[0.9, -1.2, 0.4, 0.3]);
    // Held out sideways, y is the better one, though the model as declared starts with x.
    let found = start_of(&system, &[(x, 2.0), (y, 0.9), (v_y, 0.4)]).expect("a start");
    assert_close(&[found[x], found[y], found[v_x], found[v_y]], &[1.2, 0.9, -0.3, 0.4]);
    // No rod of 1.5 m reaches 2 m.
    let failure = start_of(&system, &[(x, 2.0), (y, -2.0)]).expect_err("no start");
    assert!(failure.contains("equation `rod") && failure.contains("`x` = 2 m"), "{failure}");
}

#[test]
fn a_start_value_that_follows_has_the_derivative_that_follows() {
    // x(0) = x_0 is free and y(0) is not: y = −√(l² − x²).
    let text = ROD.replace("THETA", "0.3").replace("OMEGA", "0.2");
    let system = model(&format!(
        "{text}
        parameter x_0 [m] = 0.9
        state x [m] = x_0
        state y [m] = -l
        state v_x [m/s] = l*omega_0*cos(theta_0)
        state v_y [m/s] = 0
        unknown tension [1/s^2] = 1
        equation right: der(x) = v_x
        equation up: der(y) = v_y
        equation force_x: der(v_x) = -tension*x
        equation force_y: der(v_y) = -tension*y - g
        equation rod: x^2 + y^2 = l^2
        "
    ));
    let times = every(0.2, 3.0);
    let solution = run(&system, &times);
    // ∂y/∂x_0 = −x/y, ∂y/∂l = l/y
    assert_close(&slopes(&system, &solution, "y", 4)[..1], &[0.9 / 1.2]);
    assert_close(&slopes(&system, &solution, "y", 1)[..1], &[-1.5 / 1.2]);
    let at = |x_0: f64| {
        let mut p = parameters(&system);
        p[4] = x_0;
        let inputs = Inputs::none();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        values(&system, &simulate(&problem, &times, &options()).expect("a solution"), "y")
    };
    // Runs to 1e-10 leave 1e-6 of a difference over 2e-4, and the third derivative 1e-8 times itself.
    let differences = at(0.9 + 1e-4).into_iter().zip(at(0.9 - 1e-4));
    let found = slopes(&system, &solution, "y", 4).into_iter();
    for (found, (above, below)) in found.zip(differences) {
        let difference = (above - below) / 2e-4;
        assert!((found - difference).abs() <= 1e-5, "{found} is not {difference}");
    }
}

#[test]
fn energy_is_kept_over_twenty_periods() {
    let [system, _] = rods(std::f64::consts::FRAC_PI_2, 0.0);
    // From rest at 90°: T = 4 √(l/g) K(sin 45°), K = 1.854074677301372 (SciPy 1.11, ellipk(0.5)).
    let period = 4.0 * (1.5_f64 / 9.81).sqrt() * 1.854_074_677_301_372;
    let times: Vec<f64> = (0..=200).map(|k| 0.1 * period * f64::from(k)).collect();
    let solution = run(&system, &times);
    let [y, v_x, v_y] = ["y", "v_x", "v_y"].map(|name| values(&system, &solution, name));
    for k in 0..times.len() {
        let energy = 0.5 * (v_x[k] * v_x[k] + v_y[k] * v_y[k]) + 9.81 * y[k];
        assert!(energy.abs() <= CLOSE, "{energy} at {}", times[k]);
    }
    let back: Vec<f64> = (0..=20).map(|n| y[10 * n]).collect();
    assert_close(&back, &[0.0; 21]);
}

#[test]
fn a_slider_follows_its_crank() {
    let head = "
        parameter r [m] = 0.5
        parameter l [m] = 1.2
        parameter M [1] = 0.7
        parameter omega_0 [rad/s] = 2
    ";
    // Unit mass on the crank pin, M on the slider at (s, 0).
    let cartesian = model(&format!(
        "{head}
        state x [m] = r
        state y [m] = 0
        state s [m] = r + l
        state u [m/s] = 0
        state v [m/s] = r*omega_0
        state w [m/s] = 0
        unknown crank_force [1/s^2] = 1
        unknown rod_force [1/s^2] = 1
        equation a: der(x) = u
        equation b: der(y) = v
        equation c: der(s) = w
        equation d: der(u) = -crank_force*x + rod_force*(s - x)
        equation e: der(v) = -crank_force*y - rod_force*y
        equation f: M*der(w) = -rod_force*(s - x)
        equation crank: x^2 + y^2 = r^2
        equation rod: (s - x)^2 + y^2 = l^2
        "
    ));
    let names: Vec<&str> =
        cartesian.signature().discrete.automata.iter().map(|a| &*a.name).collect();
    assert_eq!(names, ["states of crank"], "the rod gives s wherever the crank is");
    // (1 r² + M s'²) dω/dt + M s' s'' ω² = 0 with s(θ) = r cos θ + √(l² − r² sin² θ).
    let angle = model(&format!(
        "{head}
        state theta [rad] = 0
        state omega [rad/s] = omega_0
        let q = sqrt(l^2 - r^2*sin(theta)^2)
        let s_1 = -r*sin(theta) - r^2*sin(theta)*cos(theta)/q
        let s_2 = -r*cos(theta) - r^2*cos(2*theta)/q - r^4*(sin(theta)*cos(theta))^2/q^3
        equation turn: der(theta) = omega
        equation inertia: (r^2 + M*s_1^2)*der(omega) + M*s_1*s_2*omega^2 = 0 [m^2/s^2]
        "
    ));
    let times = every(0.25, 10.0);
    let (found, expected) = (run(&cartesian, &times), run(&angle, &times));
    let theta = values(&angle, &expected, "theta");
    let slider = |t: &f64| 0.5 * t.cos() + (1.44 - 0.25 * t.sin() * t.sin()).sqrt();
    let s: Vec<f64> = theta.iter().map(slider).collect();
    assert_close(&values(&cartesian, &found, "s"), &s);
    // ∂s/∂M and ∂s/∂omega_0
    for j in [2, 3] {
        let dtheta = slopes(&angle, &expected, "theta", j);
        let along = theta.iter().zip(&dtheta).map(|(t, d)| {
            let q = (1.44 - 0.25 * t.sin() * t.sin()).sqrt();
            (-0.5 * t.sin() - 0.25 * t.sin() * t.cos() / q) * d
        });
        let along: Vec<f64> = along.collect();
        assert_close(&slopes(&cartesian, &found, "s", j), &along);
    }
}

#[test]
fn a_rod_may_break() {
    let text = ROD.replace("THETA", "1.4").replace("OMEGA", "0");
    let system = model(&format!(
        "{text}
        parameter most [1/s^2] = 15
        state x [m] = l*sin(theta_0)
        state y [m] = -l*cos(theta_0)
        state v_x [m/s] = l*omega_0
        state v_y [m/s] = 0
        unknown tension [1/s^2] = 1
        equation right: der(x) = v_x
        equation up: der(y) = v_y
        equation force_x: der(v_x) = -tension*x
        equation force_y: der(v_y) = -tension*y - g
        modes rod {{
          whole {{ equation rod: x^2 + y^2 = l^2 }}
          broken {{ equation none: tension = 0 [1/s^2] }}
          whole -> broken when tension rises above most
        }}
        "
    ));
    let times = every(0.1, 1.5);
    let solution = run(&system, &times);
    assert_eq!(solution.events.len(), 1, "{:?}", solution.events);
    let t_b = solution.events[0].t;
    // T = ω² + g cos θ/l with ω² = 2 g (cos θ − cos θ₀)/l breaks at cos θ = (T l/g + 2 cos θ₀)/3, and
    // then the mass falls freely.
    let (g, l): (f64, f64) = (9.81, 1.5);
    let cos = (15.0 * l / g + 2.0 * 1.4_f64.cos()) / 3.0;
    let theta = cos.acos();
    let omega = -(2.0 * g / l * (cos - 1.4_f64.cos())).sqrt();
    let fall = |t: f64| {
        let (x, y) = (l * theta.sin(), -l * cos);
        let (u, v) = (l * omega * cos, l * omega * theta.sin());
        let t = t - t_b;
        (x + u * t, y + v * t - 0.5 * g * t * t)
    };
    let (x, y) = (values(&system, &solution, "x"), values(&system, &solution, "y"));
    let after = times.iter().position(|t| *t > t_b).expect("a time after");
    let expected: Vec<(f64, f64)> = times[after..].iter().map(|t| fall(*t)).collect();
    assert!(expected.len() > 5);
    assert_close(&x[after..], &expected.iter().map(|(x, _)| *x).collect::<Vec<f64>>());
    assert_close(&y[after..], &expected.iter().map(|(_, y)| *y).collect::<Vec<f64>>());
    // To the strength of the rod, against runs with others: their error of 1e-10 over 2e-3.
    let at = |most: f64| {
        let mut p = parameters(&system);
        p[4] = most;
        let inputs = Inputs::none();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        values(&system, &simulate(&problem, &times, &options()).expect("a solution"), "y")
    };
    let differences = at(15.0 + 1e-3).into_iter().zip(at(15.0 - 1e-3));
    for (k, (above, below)) in differences.enumerate() {
        let difference = (above - below) / 2e-3;
        let found = slopes(&system, &solution, "y", 4)[k];
        assert!((found - difference).abs() <= 1e-5, "{found} is not {difference} at {}", times[k]);
    }
}

#[test]
fn each_rod_of_a_chain_chooses_its_own_states() {
    let mut text = "constant g [m/s^2] = 9.81\nparameter l [m] = 1\n".to_owned();
    for i in 1..=5 {
        let (left, right) = (i - 1, i + 1);
        let (x, y) = if i == 1 {
            ("0 [m]".to_owned(), "0 [m]".to_owned())
        } else {
            (format!("x{left}"), format!("y{left}"))
        };
        let [pull_x, pull_y] = ["x", "y"].map(|c| match i {
            5 => String::new(),
            _ => format!(" + t{right}*({c}{right} - {c}{i})"),
        });
        let _ = writeln!(
            text,
            "state x{i} [m] = {i}*l
            state y{i} [m] = 0
            state u{i} [m/s] = 0
            state v{i} [m/s] = 0
            unknown t{i} [1/s^2] = 1
            equation a{i}: der(x{i}) = u{i}
            equation b{i}: der(y{i}) = v{i}
            equation c{i}: der(u{i}) = -t{i}*(x{i} - {x}){pull_x}
            equation d{i}: der(v{i}) = -t{i}*(y{i} - {y}){pull_y} - g
            equation rod{i}: (x{i} - {x})^2 + (y{i} - {y})^2 = l^2"
        );
    }
    let system = model(&text);
    let names: Vec<&str> = system.signature().discrete.automata.iter().map(|a| &*a.name).collect();
    let expected = [1, 2, 3, 4, 5].map(|i| format!("states of rod{i}"));
    assert_eq!(names, expected);
    // A chain let go from level: its energy stays zero.
    let times = every(0.1, 1.0);
    let (p, inputs) = (parameters(&system), Inputs::none());
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &times, &options()).expect("a solution");
    for (k, t) in times.iter().enumerate() {
        let at = |name: String| solution.y(k)[position(&system, &name)];
        let energy: f64 = (1..=5)
            .map(|i| {
                let (u, v) = (at(format!("u{i}")), at(format!("v{i}")));
                0.5 * (u * u + v * v) + 9.81 * at(format!("y{i}"))
            })
            .sum();
        assert!(energy.abs() <= CLOSE, "{energy} at {t}");
    }
}

/// The sign of a parameter stays what it is, so that a constraint with it can be differentiated.
#[test]
fn a_sign_that_time_does_not_change_jumps_nowhere() {
    let system = model(
        "parameter p = 2
         state y = 1
         state x = 1.1
         unknown f = -1
         equation y: der(y) = -y/1 [s]
         equation x: der(x) = f/1 [s]
         equation rod: x = y + 0.1*sign(p)",
    );
    let solution = run(&system, &[0.0, 1.0]);
    let found = [values(&system, &solution, "x")[1], values(&system, &solution, "f")[1]];
    let decayed = (-1.0_f64).exp();
    for (found, expected) in found.iter().zip([decayed + 0.1, -decayed]) {
        assert!((found - expected).abs() < CLOSE, "{found} {expected}");
    }
}

#[test]
fn an_array_beside_an_index_to_reduce_stays_an_array() {
    let with = |other: &str| {
        model(&format!(
            "{other}
            state a = 0.3
            state b = 0.1
            unknown pull [1/s]
            equation a: der(a) = -a/1 [s]
            equation b: der(b) = pull
            equation tie: b = tanh(a)"
        ))
    };
    let array = with("unknown u[1..4]\nfor i in 1..4 { equation u[i]: u[i] = 0.3*i }");
    let alone = with("");
    let times = every(0.5, 2.0);
    let (found, expected) = (run(&array, &times), run(&alone, &times));
    for name in ["a", "b", "pull"] {
        assert_close(&values(&array, &found, name), &values(&alone, &expected, name));
    }
    assert_eq!(array.signature().unknowns.single.len(), 3, "the others are elements");
    assert_close(&values(&array, &found, "u[3]"), &vec![0.9; times.len()]);
}

#[test]
fn levels_of_an_array_that_a_connection_ties_move_together() {
    let system = model(
        "
        size N = 3
        parameter A [m^2] = 2
        parameter q_in [m^3/s] = 0.3
        state h[i in 1..N] [m] = i*1 [m]
        unknown q[1..N] [m^3/s]
        equation first: A*der(h[1]) = q_in - q[1]
        for i in 2..N { equation level[i]: A*der(h[i]) = q[i-1] - q[i] }
        for i in 2..N { equation tie[i]: h[i] = h[i-1] }
        equation last: q[N] = 0 [m^3/s]
        ",
    );
    let times = every(1.0, 10.0);
    let solution = run(&system, &times);
    // h = 1 + q_in t/(3 A), q₁ = 2 q_in/3.
    let h: Vec<f64> = times.iter().map(|t| 1.0 + 0.05 * t).collect();
    for name in ["h[1]", "h[2]", "h[3]"] {
        assert_close(&values(&system, &solution, name), &h);
    }
    assert_close(&values(&system, &solution, "q[1]"), &vec![0.2; times.len()]);
    let by_area: Vec<f64> = times.iter().map(|t| -0.3 * t / 12.0).collect();
    assert_close(&slopes(&system, &solution, "h[3]", 0), &by_area);
}

#[test]
fn points_on_a_sphere_swing_as_their_angles_say() {
    // In planes through the vertical, so that each is a pendulum.
    let n = 20;
    let system = model(&format!(
        "
        size N = {n}
        parameter g [m/s^2] = 9.81
        state x[i in 1..N] [m] = sin(0.1*i)*cos(0.3*i)*1 [m]
        state y[i in 1..N] [m] = sin(0.1*i)*sin(0.3*i)*1 [m]
        state z[i in 1..N] [m] = -cos(0.1*i)*1 [m]
        state u[i in 1..N] [m/s] = 0
        state v[i in 1..N] [m/s] = 0
        state w[i in 1..N] [m/s] = 0
        unknown pull[1..N] [1/s^2]
        for i in 1..N {{
          equation way_x[i]: der(x[i]) = u[i]
          equation way_y[i]: der(y[i]) = v[i]
          equation way_z[i]: der(z[i]) = w[i]
          equation force_x[i]: der(u[i]) = -pull[i]*x[i]
          equation force_y[i]: der(v[i]) = -pull[i]*y[i]
          equation force_z[i]: der(w[i]) = -pull[i]*z[i] - g
          equation sphere[i]: x[i]^2 + y[i]^2 + z[i]^2 = 1 [m^2]
        }}
        "
    ));
    let times = every(0.5, 2.0);
    let found = run(&system, &times);
    for i in [1, 7, 20] {
        let angle = model(&format!(
            "
            parameter g [m/s^2] = 9.81
            state theta = 0.1*{i}
            state omega [1/s] = 0
            equation angle: der(theta) = omega
            equation pivot: der(omega) = -g/1 [m]*sin(theta)
            "
        ));
        let expected = run(&angle, &times);
        let theta = values(&angle, &expected, "theta");
        let by_g = slopes(&angle, &expected, "theta", 0);
        let plane = (0.3 * f64::from(i)).cos();
        let x: Vec<f64> = theta.iter().map(|theta| theta.sin() * plane).collect();
        let z: Vec<f64> = theta.iter().map(|theta| -theta.cos()).collect();
        let dz: Vec<f64> = theta.iter().zip(&by_g).map(|(theta, by)| theta.sin() * by).collect();
        assert_close(&values(&system, &found, &format!("x[{i}]")), &x);
        assert_close(&values(&system, &found, &format!("z[{i}]")), &z);
        assert_close(&slopes(&system, &found, &format!("z[{i}]"), 0), &dz);
    }
}
