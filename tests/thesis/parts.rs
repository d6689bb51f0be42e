//! The parts that the thesis' models are made of: distributed lines, friction laws, the subsea pump.
//! Each is held against formulas that are worked out here, or against published numbers.

use std::f64::consts::PI;
use std::path::Path;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::LoadedSystem;
use dgd_runtime::{
    InputColumn, Inputs, Observations, Options, Problem, Solution, System, observe, simulate,
};

use crate::support::{compiled_text, root};

const G: f64 = 9.81;
const RHO: f64 = 1120.0;
const INCH: f64 = 0.0254;
const LPM: f64 = 1e-3 / 60.0;

/// A model of the folder `models`, with its variants and values chosen as on the command line.
fn model(file: &str, variants: &[&str], settings: &[&str]) -> LoadedSystem {
    let path = root().join("models").join(file);
    let text = std::fs::read_to_string(&path).expect("a model file");
    loaded(&path, text, variants, settings)
}

/// A model that stands in the folder `models` as far as its imports go.
fn written(text: &str) -> LoadedSystem {
    loaded(&root().join("models/in_a_test.dgd"), text.to_owned(), &[], &[])
}

fn loaded(path: &Path, text: String, variants: &[&str], settings: &[&str]) -> LoadedSystem {
    let variants: Vec<(&str, &str)> =
        variants.iter().map(|variant| variant.split_once('=').expect("NAME=CHOICE")).collect();
    let compiled = compiled_text(path, text, (&variants, settings), &SensitivityDirections::None);
    LoadedSystem::new(compiled.program)
}

/// A run, read by name.
struct Run<'a> {
    system: &'a LoadedSystem,
    solution: Solution,
    observations: Observations,
}

impl Run<'_> {
    /// An unknown, at all times.
    fn unknown(&self, name: &str) -> Vec<f64> {
        let i = self.system.signature().unknowns.iter().position(|x| x.name == name);
        let i = i.unwrap_or_else(|| panic!("no unknown `{name}`"));
        (0..self.solution.len()).map(|k| self.solution.y(k)[i]).collect()
    }

    /// An output, at all times.
    fn output(&self, name: &str) -> Vec<f64> {
        let i = self.system.signature().outputs.iter().position(|x| x.name == name);
        let i = i.unwrap_or_else(|| panic!("no output `{name}`"));
        (0..self.solution.len()).map(|k| self.observations.w(k)[i]).collect()
    }
}

/// Runs a model to `tolerance` and reads it at `times`; inputs are sampled at `samples`, in SI.
fn run<'a>(
    system: &'a LoadedSystem,
    samples: &[f64],
    inputs: &[(&str, &[f64])],
    times: &[f64],
    tolerance: f64,
) -> Run<'a> {
    let signature = system.signature();
    let columns: Vec<InputColumn<'_>> = (signature.inputs.iter())
        .map(|input| {
            let given = inputs.iter().find(|(name, _)| *name == input.name);
            let (name, values) = given.unwrap_or_else(|| panic!("no values of `{}`", input.name));
            InputColumn { name, interpolation: input.interpolation, values }
        })
        .collect();
    let inputs = if columns.is_empty() {
        Inputs::none()
    } else {
        Inputs::recorded(samples, &columns).expect("sound inputs")
    };
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    let options = Options { rtol: tolerance, atol: tolerance, ..Options::default() };
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, times, &options).expect("a solution");
    let observations = observe(&problem, &solution);
    Run { system, solution, observations }
}

/// `n + 1` numbers from `a` to `b`.
fn steps(a: f64, b: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| a + (b - a) * k as f64 / n as f64).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[track_caller]
fn assert_near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found} is not {expected}");
}

/// Where a rising function is zero, by halving.
fn root_of(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    assert!(f(low) < 0.0 && f(high) > 0.0, "{} and {}", f(low), f(high));
    for _ in 0..200 {
        let middle = low.midpoint(high);
        *(if f(middle) < 0.0 { &mut low } else { &mut high }) = middle;
    }
    low.midpoint(high)
}

// --- Lines. ---

const BETA: f64 = 1.5e9;
const LENGTH: f64 = 1200.0;
const AREA: f64 = PI / 4.0 * 6.05 * INCH * 6.05 * INCH;

/// Speed of sound of the line as its file has it.
fn speed_of_sound() -> f64 {
    (BETA / RHO).sqrt()
}

/// A level line without friction, for waves.
const PLAIN: [&str; 3] = ["K=0", "theta=90", "q_0=0"];

/// When the pressure rises to half of the front's in the line's middle, after a step of the flow.
fn arrival(cells: usize) -> f64 {
    let n = format!("N={cells}");
    let system =
        model("transmission_line.dgd", &["friction=quadratic"], &[&PLAIN[..], &[&n]].concat());
    // As the line is level and at rest, all is at p_0 = 10 bar before.
    let (rest, jump) = (10e5, 1e-3);
    let half = 0.5 * RHO * speed_of_sound() * jump / AREA;
    let times = steps(0.0, 0.8, 1600);
    let inputs = [("q_in", &[jump, jump][..]), ("p_out", &[rest, rest])];
    let run = run(&system, &[0.0, 1.0], &inputs, &times, 1e-6);
    // Between the two cells that meet in the middle, and between two samples.
    let [left, right] = [cells / 2, cells / 2 + 1].map(|i| run.unknown(&format!("p[{i}]")));
    let rise: Vec<f64> =
        left.iter().zip(&right).map(|(a, b)| a.midpoint(*b) - rest - half).collect();
    let k = rise.iter().position(|rise| *rise > 0.0).expect("the front passes");
    times[k] - (times[k] - times[k - 1]) * rise[k] / (rise[k] - rise[k - 1])
}

#[test]
fn a_front_travels_at_the_speed_of_sound() {
    let expected = LENGTH / 2.0 / speed_of_sound();
    let errors = [25, 50, 100, 200].map(|cells| (arrival(2 * (cells / 2)) - expected).abs());
    // Behind a front that has passed n cells, staggered differences leave ripples some n^(1/3)
    // cells wide, so that the place of half the height is off by L/N n^(1/3): twice the cells, 0.63
    // of the error.
    for pair in errors.windows(2) {
        let ratio = pair[1] / pair[0];
        assert!((0.55..0.72).contains(&ratio), "{errors:?}");
    }
    assert!(errors[3] < 0.01 * expected, "{errors:?}");
}

#[test]
fn a_valve_that_closes_at_once_raises_the_pressure_by_that_of_joukowsky() {
    let (rest, flow, begin) = (10e5, 2000.0 * LPM, 0.1);
    let settings = ["K=0", "theta=90", "N=200", "q_0=2000", "p_0=10"];
    let ends = ["friction=quadratic", "inlet=pressure", "outlet=flow"];
    let system = model("transmission_line.dgd", &ends, &settings);
    let inputs = [("p_in", &[rest; 3][..]), ("q_out", &[flow, 0.0, 0.0])];
    let times = steps(0.0, 4.3, 4300);
    let run = run(&system, &[0.0, begin, 5.0], &inputs, &times, 1e-6);
    let c = speed_of_sound();
    let rise = RHO * c * flow / AREA;
    // The wave goes to the open inlet and comes back with the other sign: up for 2 L/c, and down.
    let there_and_back = 2.0 * LENGTH / c;
    let last = run.unknown("p[200]");
    let between = |from: f64, to: f64| {
        let inside = times.iter().zip(&last).filter(|(t, _)| (from..to).contains(*t));
        mean(&inside.map(|(_, p)| p - rest).collect::<Vec<f64>>())
    };
    // Away from the fronts, ripples cancel in the mean.
    let up = between(begin + 0.2, begin + there_and_back - 0.2);
    let down = between(begin + there_and_back + 0.3, begin + 2.0 * there_and_back - 0.3);
    assert_near(up, rise, 1e-3);
    assert_near(down, -rise, 1e-3);
}

#[test]
fn waves_without_friction_keep_their_energy() {
    let (rest, flow, begin) = (10e5, 2000.0 * LPM, 0.1);
    let settings = ["K=0", "theta=90", "N=20", "q_0=2000", "p_0=10"];
    let ends = ["friction=quadratic", "inlet=pressure", "outlet=flow"];
    let system = model("transmission_line.dgd", &ends, &settings);
    let inputs = [("p_in", &[rest; 3][..]), ("q_out", &[flow, 0.0, 0.0])];
    let times = steps(0.2, 10.0, 50);
    let run = run(&system, &[0.0, begin, 10.0], &inputs, &[&[0.0], &times[..]].concat(), 1e-9);
    let dx = LENGTH / 20.0;
    // What is compressed and what moves; half a cell belongs to the flow at either end.
    let p: Vec<Vec<f64>> = (1..=20).map(|i| run.unknown(&format!("p[{i}]"))).collect();
    let q: Vec<Vec<f64>> = (1..=21).map(|i| run.unknown(&format!("q[{i}]"))).collect();
    let energy = |k: usize| {
        let compressed: f64 = p.iter().map(|p| (p[k] - rest).powi(2)).sum();
        let ends = 0.5 * (q[0][k].powi(2) + q[20][k].powi(2));
        let moved: f64 = q[1..20].iter().map(|q| q[k].powi(2)).sum();
        AREA * dx / (2.0 * BETA) * compressed + RHO * dx / (2.0 * AREA) * (ends + moved)
    };
    let before = RHO * (LENGTH - dx / 2.0) / (2.0 * AREA) * flow * flow;
    for k in 1..=times.len() {
        assert_near(energy(k), before, 1e-6);
    }
}

/// Loss per length of a flow with a Reynolds number on hydraulic diameter: laminar with `number`
/// over it, Haaland's law, and a cubic in between.
fn conduit_loss(number: f64, mu: f64, area: f64, d: f64, eps: f64, q: f64) -> f64 {
    let v = q / area;
    let re = RHO * v.abs() * d / mu;
    let dynamic = RHO * v * v.abs() / (2.0 * d);
    let haaland = |re: f64| (-1.8 * (6.9 / re + (eps / d / 3.7).powf(1.11)).log10()).powi(-2);
    if re <= 2300.0 {
        return if re == 0.0 { 0.0 } else { number / re * dynamic };
    }
    let x = ((re - 2300.0) / 1700.0).min(1.0);
    let share = x * x * (3.0 - 2.0 * x);
    ((1.0 - share) * number / re + share * haaland(re)) * dynamic
}

/// Darcy's f times Re between concentric pipes: Navier and Stokes in a ring (H. Lamb, Hydrodynamics
/// (1932), section 331), by the radii.
fn ring(inner: f64, outer: f64) -> f64 {
    let (a2, b2) = (inner * inner, outer * outer);
    64.0 * (outer - inner).powi(2) / (b2 + a2 - (b2 - a2) / (outer / inner).ln())
}

#[test]
fn a_steady_line_has_the_pressures_of_friction_and_weight() {
    // A pipe down, up and askew; laminar (Re 773), between (3093) and turbulent (15466); a ring.
    for (theta, d_rod, lpm) in
        [(0.0_f64, 0.0, 2000.0), (180.0, 0.0, 400.0), (60.0, 0.0, 100.0), (180.0, 5.0, 2000.0)]
    {
        let settings = [
            format!("theta={theta}"),
            format!("d_rod={d_rod}"),
            format!("q_0={lpm}"),
            "p_0=300".to_owned(),
        ];
        let system = model("transmission_line.dgd", &[], &settings.each_ref().map(String::as_str));
        let (flow, behind) = (lpm * LPM, 300e5);
        let inputs = [("q_in", &[flow, flow][..]), ("p_out", &[behind, behind])];
        let run = run(&system, &[0.0, 60.0], &inputs, &[0.0, 60.0], 1e-8);

        let (d, rod) = (6.05 * INCH, d_rod * INCH);
        let area = PI / 4.0 * (d * d - rod * rod);
        let number = if rod == 0.0 { 64.0 } else { ring(rod / 2.0, d / 2.0) };
        let loss = conduit_loss(number, 0.02, area, d - rod, 5e-5, flow);
        let gradient = loss - RHO * G * theta.to_radians().cos();
        for i in 1..=10 {
            // From the middle of a cell it is half a cell less to the end.
            let expected = behind + (10.5 - f64::from(i)) * LENGTH / 10.0 * gradient;
            let p = run.unknown(&format!("p[{i}]"));
            assert_near(p[0], expected, 1e-12);
            assert_near(p[1], expected, 1e-7);
        }
        for i in 1..=11 {
            assert_near(run.unknown(&format!("q[{i}]"))[1], flow, 1e-7);
        }
    }
    // A narrow ring is a gap between plates, a wide one hardly a pipe with a wire in it.
    assert_near(ring(0.999, 1.0), 96.0, 1e-5);
    assert_near(ring(0.5, 1.0), 95.25, 1e-4);
}

#[test]
fn a_disturbed_line_comes_to_rest_there() {
    // Viscous enough: what is left fades with 16 mu/(rho d^2) = 0.30/s, after 100 s by 1e-13.
    let settings = ["mu=500", "q_0=1000", "theta=120"];
    let system = model("transmission_line.dgd", &[], &settings);
    let (flow, behind) = (2000.0 * LPM, 10e5);
    let inputs = [("q_in", &[flow, flow][..]), ("p_out", &[behind, behind])];
    let run = run(&system, &[0.0, 100.0], &inputs, &[0.0, 100.0], 1e-8);
    let d: f64 = 6.05 * INCH;
    // Hagen and Poiseuille, and half of the weight.
    let gradient = 128.0 * 0.5 * flow / (PI * d.powi(4)) + 0.5 * RHO * G;
    for i in 1..=10 {
        let expected = behind + (10.5 - f64::from(i)) * LENGTH / 10.0 * gradient;
        let p = run.unknown(&format!("p[{i}]"));
        assert!((p[0] / expected - 1.0).abs() > 1e-3, "{} was there before", p[0]);
        assert_near(p[1], expected, 1e-6);
    }
}

#[test]
fn a_stiff_line_is_the_lumped_one() {
    let (k, flow, behind) = (1e5, 2000.0 * LPM, 10e5);
    // Steady at first; then 5 bar more. The weight is that of theta = 180: all upwards.
    let before = behind + LENGTH * (k * flow * flow + RHO * G);
    let driving = [before, before + 5e5, before + 5e5];
    let (samples, times) = ([0.0, 1.0, 21.0], steps(0.0, 20.0, 80));

    let m = format!("M={}", RHO * LENGTH / AREA);
    let f2 = format!("F2={}", k * LENGTH);
    let start = format!("q={flow}");
    let lumped = model("parts/return_line.dgd", &[], &[&m, &f2, &start]);
    let dp = driving.map(|p| p - behind - LENGTH * RHO * G);
    let expected = run(&lumped, &samples, &[("dp", &dp)], &times, 1e-9).unknown("q");
    assert!(expected[80] > 1.5 * flow);

    let distance = |beta: &str| {
        let settings = ["N=5", "theta=180", "K=1e5", "q_0=2000", "p_0=10", beta];
        let ends = ["friction=quadratic", "inlet=pressure"];
        let system = model("transmission_line.dgd", &ends, &settings);
        let inputs = [("p_in", &driving[..]), ("p_out", &[behind; 3])];
        let q = run(&system, &samples, &inputs, &times, 1e-9).output("q_last");
        q.iter().zip(&expected).fold(0.0_f64, |most, (q, e)| most.max((q - e).abs()))
    };
    // Waves are left: the step sends a front through the line that is A dp/(rho c) high, ten
    // times less for a hundred times the bulk modulus.
    for (beta, relative) in [("beta=1.5e4", 1.0), ("beta=1.5e6", 1e2), ("beta=1.5e8", 1e4)] {
        let front = AREA * 5e5 / (RHO * (BETA * relative / RHO).sqrt());
        let share = distance(beta) / front;
        assert!((0.7..1.15).contains(&share), "{beta}: {share} of {front:e} m^3/s");
    }
}

/// A well whose mud is counted at both ends.
const COUNTED: &str = "
model counted_well
import \"lines_of_the_well.dgd\"
input q_p   [m^3/s] linear
input w_ssp [%]     linear
part well: lines_of_the_well(N = 8)
well.q_p = q_p
well.w_ssp = w_ssp
state pumped   [m^3] = 0  nominal 1
state returned [m^3] = 0  nominal 1
equation in:  der(pumped) = q_p
equation out: der(returned) = well.q_out
output h_r [m] = well.h_r
";

#[test]
fn no_mud_is_lost_in_the_lines_of_the_well() {
    let system = written(COUNTED);
    let times = steps(0.0, 60.0, 60);
    let flows = [2000.0, 2000.0, 2600.0, 2600.0, 1500.0].map(|q| q * LPM);
    let speeds = [0.77, 0.77, 0.80, 0.90, 0.75];
    let samples = [0.0, 1.0, 2.0, 30.0, 60.0];
    let run = run(&system, &samples, &[("q_p", &flows), ("w_ssp", &speeds)], &times, 1e-6);
    let area = |outer: f64, inner: f64| PI / 4.0 * (outer * outer - inner * inner) * INCH * INCH;
    let beta = 2e9;
    let mut stored = vec![0.0; times.len()];
    for (line, area, length) in [
        ("string", area(4.276, 0.0), 2000.0),
        ("annulus", area(9.85, 5.0), 2000.0 - 307.0),
        ("return", area(6.05, 0.0), 302.0),
    ] {
        for i in 1..=8 {
            let p = run.unknown(&format!("well.{line}.p[{i}]"));
            stored.iter_mut().zip(p).for_each(|(v, p)| *v += area * length / 8.0 / beta * p);
        }
    }
    // A larger level is less mud.
    let level = run.output("h_r");
    stored.iter_mut().zip(level).for_each(|(v, h)| *v -= area(19.75, 5.0) * h);
    let (pumped, returned) = (run.unknown("pumped"), run.unknown("returned"));
    assert!(pumped[60] > 2.0 && (pumped[60] - returned[60]).abs() > 0.01);
    let worst = (0..times.len())
        .map(|k| (stored[k] - stored[0] - (pumped[k] - returned[k])).abs())
        .fold(0.0, f64::max);
    // 28 m^3 stand in the riser; each of a few hundred steps rounds them.
    assert!(worst < 300.0 * 28.0 * f64::EPSILON, "{worst:e} m^3");
}

#[test]
fn pressures_of_the_steady_well_are_those_by_hand() {
    let system = model("lines_of_the_well.dgd", &[], &[]);
    let flow = 2000.0 * LPM;
    let (mu, eps) = (0.02, 5e-5);
    let pipe = |d: f64| conduit_loss(64.0, mu, PI / 4.0 * d * d, d, eps, flow);
    let (outer, inner) = (9.85 * INCH, 5.0 * INCH);
    let annulus = {
        let area = PI / 4.0 * (outer * outer - inner * inner);
        conduit_loss(ring(inner / 2.0, outer / 2.0), mu, area, outer - inner, eps, flow)
    };
    let (l, h_in, h_out, h_r) = (2000.0, 307.0, 302.0, 150.0);
    // Up from the bit to the pump's inlet, on top of the riser's mud.
    let p_bit = RHO * G * (h_in - h_r) + (l - h_in) * (RHO * G + annulus);
    let nozzles = 0.5 * RHO * (flow / (0.95 * 0.45 * INCH * INCH)).powi(2);
    let p_p = p_bit + nozzles + l * (pipe(4.276 * INCH) - RHO * G);
    // What the return line asks for at its lower end, and the speed at which the pump gives it.
    let p_out = h_out * (RHO * G + pipe(6.05 * INCH));
    let head = p_out / (RHO * G) - (h_in - h_r);
    let speed = ((head + 9.0e3 * flow * flow) / 275.0).sqrt();
    assert_near(speed, 0.772_374_7, 1e-6);

    let inputs = [("q_p", &[flow, flow][..]), ("w_ssp", &[speed, speed])];
    let run = run(&system, &[0.0, 20.0], &inputs, &[0.0, 20.0], 1e-8);
    for (output, expected) in
        [("p_bit", p_bit), ("p_p", p_p), ("p_out", p_out), ("q_out", flow), ("h_r", h_r)]
    {
        let found = run.output(output);
        assert_near(found[0], expected, 1e-10);
        assert_near(found[1], expected, 1e-6);
    }
}

#[test]
fn the_bit_feels_the_mud_pump_after_the_time_that_sound_needs() {
    let system = model("lines_of_the_well.dgd", &[], &["N=80"]);
    let (flow, speed) = (2000.0 * LPM, 0.772_374_743_454_580_6);
    let flows = [flow, flow, 1.1 * flow, 1.1 * flow];
    let times = steps(0.0, 6.0, 600);
    let inputs = [("q_p", &flows[..]), ("w_ssp", &[speed; 4])];
    let run = run(&system, &[0.0, 1.0, 1.1, 6.0], &inputs, &times, 1e-6);
    let c = (2e9_f64 / RHO).sqrt();
    let first = |name: &str, share: f64| {
        let values = run.output(name);
        let k = values.iter().position(|x| (x - values[0]).abs() > share * values[0]);
        times[k.expect("it arrives")] - 1.0
    };
    // Down the string, up the annulus, and on through the pump to the rig.
    let bit = first("q_bit", 0.01);
    let annulus = first("q_a", 0.01);
    assert_near(bit, 2000.0 / c, 0.06);
    assert_near(annulus, (2000.0 + 1693.0) / c, 0.06);
}

// --- Friction. ---

/// A formula of the friction library over a sweep of `x` from `a` to `b`.
fn swept(formula: &str, (a, b): (f64, f64), n: usize) -> Vec<f64> {
    let text =
        format!("model swept\nimport \"lib/friction.dgd\"\ninput x linear\noutput y = {formula}\n");
    let system = written(&text);
    let times = steps(0.0, 1.0, n);
    run(&system, &[0.0, 1.0], &[("x", &[a, b])], &times, 1e-6).output("y")
}

/// Darcy's friction factor of Colebrook (1939), by 1/sqrt(f).
fn colebrook(re: f64, roughness: f64) -> f64 {
    let off = |x: f64| x + 2.0 * (roughness / 3.7 + 2.51 * x / re).log10();
    root_of(off, 1.0, 20.0).powi(-2)
}

#[test]
fn haalands_factor_is_that_of_moodys_chart() {
    // Y. A. Cengel, J. M. Cimbala, Fluid Mechanics, 2nd ed. (2010): figure 8-26, at Re = 1e6, and
    // example 8-3.
    let published = [
        (1e6, 0.0, 0.0116),
        (1e6, 1e-5, 0.0119),
        (1e6, 1e-4, 0.0134),
        (1e6, 5e-4, 0.0172),
        (1e6, 1e-3, 0.0199),
        (1e6, 5e-3, 0.0305),
        (1e6, 1e-2, 0.0380),
        (1e6, 5e-2, 0.0716),
        (126_400.0, 4.2e-5, 0.0174),
    ];
    let haaland = |re: f64, roughness: f64| {
        swept(&format!("haaland({re:?}*x, {roughness:?})"), (1.0, 1.0), 1)[0]
    };
    for (re, roughness, factor) in published {
        // The figures printed are rounded; Haaland stays within 2 % of Colebrook.
        let exact = colebrook(re, roughness);
        assert!((exact - factor).abs() < 1e-4, "{exact} is not {factor}");
        assert_near(haaland(re, roughness), exact, 0.02);
    }
    // The whole of Moody's chart: Re from 4000 to 1e8, ten times by logarithm.
    for roughness in [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2] {
        let formula = format!("haaland(4000*10^x, {roughness:?})");
        for (x, found) in steps(0.0, 4.4, 44).iter().zip(swept(&formula, (0.0, 4.4), 44)) {
            assert_near(found, colebrook(4000.0 * 10_f64.powf(*x), roughness), 0.02);
        }
    }
}

/// The loss of the library in a pipe of 50 mm, by its Reynolds number: oil of 20 mPa s.
const OIL: &str = "conduit_loss(64, 870 [kg/m^3], 0.02 [Pa*s], pi/4*(0.05 [m])^2, 0.05 [m], \
                   5e-5 [m], x*pi/4*0.05 [m]*0.02 [Pa*s]/(870 [kg/m^3]))/1 [Pa/m]";

#[test]
fn the_loss_goes_over_from_laminar_to_turbulent_without_a_jump() {
    let n = 6000;
    let loss = swept(OIL, (0.0, 6000.0), n);
    let (d, mu, rho) = (0.05, 0.02, 870.0);
    let speed = |re: f64| re * mu / (rho * d);
    for (re, found) in loss.iter().enumerate() {
        let v = speed(re as f64);
        if re <= 2300 {
            // Hagen and Poiseuille, to rounding.
            assert!((found - 32.0 * mu * v / (d * d)).abs() < 1e-12 * loss[n], "{found} at {re}");
        } else if re >= 4000 {
            let inner: f64 = 6.9 / re as f64 + (1e-3_f64 / 3.7).powf(1.11);
            let f = (-1.8 * inner.log10()).powi(-2);
            assert_near(*found, f * rho * v * v / (2.0 * d), 1e-12);
        }
    }
    // It always rises, so that a pressure belongs to one flow, and so does its slope change little
    // by little: the cubic's steepest part is 1.5/1700 of the way in a unit of Re.
    let slopes: Vec<f64> = loss.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(slopes.iter().all(|slope| *slope > 0.0));
    let steepest = slopes.iter().copied().fold(0.0, f64::max);
    for pair in slopes.windows(2) {
        assert!((pair[1] - pair[0]).abs() < 0.005 * steepest, "{pair:?}");
    }
    // Backwards it is the same.
    let back = swept(&OIL.replace("x*pi", "(-x)*pi"), (0.0, 6000.0), 6);
    // (With x the abscissa, Re = -x.)
    for (k, found) in back.iter().enumerate() {
        assert_eq!(*found, -loss[1000 * k]);
    }
}

/// The column of models/pipe_flow.dgd with the continuous loss.
const COLUMN: &str = "
model column
import \"lib/friction.dgd\"
constant rho [kg/m^3] = 870
constant d   [mm]     = 50
constant l   [m]      = 100
let A = pi/4*d^2
input dp [bar] linear
state q [lpm] = 0  nominal 300
equation column: rho*l/A * der(q) = dp - l*conduit_loss(64, rho, 20 [mPa*s], A, d, 0.05 [mm], q)
";

#[test]
fn the_solver_passes_the_transition_with_an_event_or_cheaply_without() {
    let jumping = model("pipe_flow.dgd", &[], &[]);
    let smooth = written(COLUMN);
    assert!(!jumping.signature().discrete.automata.is_empty());
    assert!(smooth.signature().discrete.automata.is_empty());

    let bar = [1e5; 2];
    let times = [0.0, 100.0];
    let with = run(&jumping, &[0.0, 100.0], &[("dp", &bar)], &times, 1e-6);
    // What the file says of its own run. Re = 2300 is passed on 1 - exp(-t/tau) with
    // tau = rho d^2/(32 mu) = 3.398 s on the way to pi d^4 dp/(128 mu l) = 460.2 lpm.
    let event = with.solution.events[0].t;
    let laminar = PI * 0.05_f64.powi(4) * 1e5 / (128.0 * 0.02 * 100.0);
    let passing = 2300.0 * PI / 4.0 * 0.05 * 0.02 / 870.0;
    assert_near(event, -870.0 * 0.05 * 0.05 / (32.0 * 0.02) * (1.0 - passing / laminar).ln(), 1e-5);
    assert_eq!(with.solution.events.len(), 1);
    assert_near(with.unknown("q")[1], 193.391 * LPM, 1e-5);

    // At 2 bar both come to one turbulent flow; the continuous loss takes no event and fewer steps
    // than the jump with what it begins anew.
    let bar = [2e5; 2];
    let with = run(&jumping, &[0.0, 100.0], &[("dp", &bar)], &times, 1e-6);
    let without = run(&smooth, &[0.0, 100.0], &[("dp", &bar)], &times, 1e-6);
    assert!(with.unknown("q")[1] > 4000.0 / 2300.0 * passing);
    assert_near(without.unknown("q")[1], with.unknown("q")[1], 1e-5);
    assert!(without.solution.events.is_empty());
    let (a, b) = (with.solution.statistics, without.solution.statistics);
    assert!(b.evaluations <= a.evaluations, "{a:?} and {b:?}");

    // A pressure between the two losses at Re = 2300: the jump holds the flow there, the continuous
    // loss has a flow for it.
    let between = [0.4e5; 2];
    let with = run(&jumping, &[0.0, 100.0], &[("dp", &between)], &times, 1e-6);
    let without = run(&smooth, &[0.0, 100.0], &[("dp", &between)], &times, 1e-6);
    assert_near(with.unknown("q")[1], passing, 1e-6);
    let loss = swept(OIL, (2300.0, 4000.0), 1700);
    let re = 2300.0 + loss.iter().position(|loss| 100.0 * loss > 0.4e5).expect("passed") as f64;
    let found = without.unknown("q")[1] / passing * 2300.0;
    assert!(re - 1.0 <= found && found <= re, "{found} is not {re}");
}

const D: f64 = 6.05 * INCH;
const L: f64 = 302.0;

/// The pressure lost by Herschel-Bulkley mud at each of the flows, in Pa.
fn mud_loss(settings: &[&str], flows: &[f64]) -> Vec<f64> {
    let system = model("parts/herschel_bulkley_pipe.dgd", &[], settings);
    let times = steps(0.0, (flows.len() - 1) as f64, flows.len() - 1);
    run(&system, &times, &[("q", flows)], &times, 1e-11).output("loss")
}

fn nominal_rate(flow: f64) -> f64 {
    8.0 * flow / (PI / 4.0 * D * D) / D
}

#[test]
fn herschel_bulkley_flow_is_newtons_ostwalds_and_binghams() {
    let flows = [20.0, 100.0, 400.0, 700.0, 1000.0].map(|q| q * LPM);
    let stress = |loss: f64| loss * D / (4.0 * L);
    // Thick enough to be laminar throughout. The creeping micrometre per second is 6e-5 of the
    // slowest flow, and adds in quadrature: 2e-9.
    let newton = mud_loss(&["tau_y=0", "K=0.1", "n=1"], &flows);
    let ostwald = mud_loss(&["tau_y=0", "K=0.8", "n=0.6"], &flows);
    let bingham = mud_loss(&["tau_y=5", "K=0.05", "n=1"], &flows);
    for (k, flow) in flows.into_iter().enumerate() {
        let rate = nominal_rate(flow);
        // Hagen and Poiseuille.
        assert_near(newton[k], 128.0 * 0.1 * L * flow / (PI * D.powi(4)), 1e-7);
        // (3n + 1)/(4n) 8 v/d at the wall.
        assert_near(stress(ostwald[k]), 0.8 * (2.8 / 2.4 * rate).powf(0.6), 1e-7);
        // Buckingham and Reiner: mu 8 v/d = tau (1 - 4/3 x + x^4/3).
        let tau = root_of(
            |tau| tau * (1.0 - 4.0 / 3.0 * (5.0 / tau) + (5.0 / tau).powi(4) / 3.0) - 0.05 * rate,
            5.0 + 1e-9,
            1e3,
        );
        assert_near(stress(bingham[k]), tau, 1e-7);
    }
}

#[test]
fn a_herschel_bulkley_profile_has_the_flow_that_it_was_made_for() {
    let flows = [20.0, 100.0, 400.0, 1000.0].map(|q| q * LPM);
    for (n, text) in [(0.5, "n=0.5"), (0.7, "n=0.7"), (1.2, "n=1.2")] {
        let losses = mud_loss(&["tau_y=4", "K=0.5", text], &flows);
        for (flow, loss) in flows.into_iter().zip(losses) {
            let tau = loss * D / (4.0 * L);
            let plug = 4.0 / tau;
            assert!((0.05..1.0).contains(&plug), "{plug}");
            // 8 v/d = 4 times the integral of the shear rate over (r/R)^2 d(r/R), outside of the
            // plug; by Simpson's rule in the root of the distance from it, where all is smooth.
            let integrand = |z: f64| {
                let s = plug + (1.0 - plug) * z * z;
                let rate = ((tau * s - 4.0).max(0.0) / 0.5).powf(1.0 / n);
                4.0 * rate * s * s * (1.0 - plug) * 2.0 * z
            };
            let panels = 2000;
            let sum: f64 = (0..=panels)
                .map(|k| {
                    let weight =
                        if k == 0 || k == panels { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
                    weight * integrand(f64::from(k) / f64::from(panels))
                })
                .sum();
            assert_near(sum / (3.0 * f64::from(panels)), nominal_rate(flow), 1e-7);
        }
    }
}

#[test]
fn turbulent_mud_follows_dodge_and_metzner() {
    let flows: Vec<f64> = steps(1000.0, 5000.0, 8).iter().map(|q| q * LPM).collect();
    let friction = |loss: f64, flow: f64| {
        let v = flow / (PI / 4.0 * D * D);
        loss * D / (4.0 * L) / (0.5 * RHO * v * v)
    };
    // Newton: Re from 6e4 up; Prandtl's and von Karman's law, which Colebrook's smooth pipe is, too,
    // with 2.51 for what 0.4 makes 2.52.
    let newton = mud_loss(&["tau_y=0", "K=0.0025", "n=1"], &flows);
    // Power law: Re and n' are given by K and n.
    let ostwald = mud_loss(&["tau_y=0", "K=0.05", "n=0.7"], &flows);
    for (k, flow) in flows.iter().copied().enumerate() {
        let v = flow / (PI / 4.0 * D * D);
        let law = |re: f64, n: f64| {
            let off = |x: f64| {
                x - 4.0 / n.powf(0.75) * (re * x.powf(n - 2.0)).log10() + 0.4 / n.powf(1.2)
            };
            root_of(off, 1.0, 100.0).powi(-2)
        };
        let re = RHO * v * D / 0.0025;
        assert_near(friction(newton[k], flow), law(re, 1.0), 1e-8);
        assert_near(4.0 * friction(newton[k], flow), colebrook(re, 0.0), 0.005);
        // Metzner and Reed: rho v^(2-n) d^n/(8^(n-1) K ((3n+1)/(4n))^n).
        let (n, consistency) = (0.7_f64, 0.05);
        let re = RHO * v.powf(2.0 - n) * D.powf(n)
            / (8_f64.powf(n - 1.0) * consistency * (3.1_f64 / 2.8).powf(n));
        assert!(re > 4150.0 - 1150.0 * n, "{re}");
        assert_near(friction(ostwald[k], flow), law(re, n), 1e-8);
    }
}

#[test]
fn the_loss_of_mud_rises_steadily_through_rest_and_transition() {
    let flows: Vec<f64> = steps(-500.0, 5000.0, 5500).iter().map(|q| q * LPM).collect();
    let loss = mud_loss(&[], &flows);
    let largest = loss[5500];
    for pair in loss.windows(2) {
        assert!(pair[1] >= pair[0], "{pair:?}");
    }
    // There and back alike; from the yield stress's 4 L/d tau_y on.
    for k in 1..=500 {
        assert_near(loss[500 + k], -loss[500 - k], 1e-9);
    }
    assert!(loss[501] > 4.0 * L / D * 2.0 && loss[501] < 1.1 * 4.0 * L / D * 2.0, "{}", loss[501]);
    // No jump beyond: a lpm is less than a hundredth of all.
    for pair in loss[501..].windows(2) {
        assert!(pair[1] - pair[0] < 0.01 * largest, "{pair:?}");
    }
}

#[test]
fn the_industrys_formula_agrees_with_the_profile_and_with_turbulence() {
    let system = model("friction.dgd", &[], &["tau_y=0", "K=0.2"]);
    let flows = steps(50.0, 5000.0, 99).iter().map(|q| q * LPM).collect::<Vec<f64>>();
    let times = steps(0.0, 99.0, 99);
    let swept = run(&system, &times, &[("q", &flows)], &times, 1e-9);
    let (profile, formula) = (swept.output("herschel_bulkley"), swept.output("api_13d"));
    let re = swept.output("re_mud");
    let mut worst = [0.0_f64; 2];
    for k in 0..100 {
        let error = (formula[k] / profile[k] - 1.0).abs();
        // Exact for a power law while it is laminar; Blasius' form of turbulence.
        if re[k] < 1500.0 {
            worst[0] = worst[0].max(error);
        } else if re[k] > 4000.0 {
            worst[1] = worst[1].max(error);
        }
    }
    assert!(worst[0] < 1e-4 && worst[1] < 0.05, "{worst:?}");
}

#[test]
fn the_polynomials_are_fitted_to_the_law_of_darcy_and_weisbach() {
    let system = model("friction.dgd", &[], &[]);
    let flows: Vec<f64> = steps(0.0, 5000.0, 50).iter().map(|q| q * LPM).collect();
    let times = steps(0.0, 50.0, 50);
    let swept = run(&system, &times, &[("q", &flows)], &times, 1e-6);
    let darcy = swept.output("darcy_weisbach");
    let area = PI / 4.0 * D * D;
    for (flow, found) in flows.iter().zip(&darcy) {
        assert_near(*found, L * conduit_loss(64.0, 0.02, area, D, 5e-5, *flow), 1e-12);
    }
    // Least squares leave a rest that no term explains, up to the four digits of the file.
    let parameters = &system.signature().parameters;
    let mut deviations = Vec::new();
    for (output, powers, coefficients) in [
        ("quadratic", &[2][..], &["F_quadratic"][..]),
        ("second_order", &[1, 2], &["F1", "F2"]),
        ("fourth_order", &[1, 2, 3, 4], &["G1", "G2", "G3", "G4"]),
    ] {
        let found = swept.output(output);
        let rest: Vec<f64> = darcy.iter().zip(&found).map(|(d, f)| d - f).collect();
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut sum = vec![0.0; flows.len()];
        for (power, coefficient) in powers.iter().zip(coefficients) {
            let term: Vec<f64> = flows.iter().map(|q: &f64| q.powi(*power)).collect();
            let along: f64 = term.iter().zip(&rest).map(|(a, b)| a * b).sum();
            let cosine = along / (norm(&term) * norm(&rest));
            assert!(cosine.abs() < 0.05, "{output}, power {power}: {cosine}");
            let value = parameters.iter().find(|p| p.name == *coefficient).expect("one").value;
            sum.iter_mut().zip(term).for_each(|(sum, term)| *sum += value * term);
        }
        found.iter().zip(sum).for_each(|(f, s)| assert!((f - s).abs() < 1e-9 * darcy[50]));
        deviations.push(norm(&rest) / norm(&darcy));
    }
    // As in figures 3.6 and 3.7: the quadratic is near, the fourth order hardly to be told apart.
    assert!(
        deviations[0] < 0.06 && deviations[1] < 0.01 && deviations[2] < 0.003,
        "{deviations:?}"
    );
}

// --- The subsea pump. ---

/// Flows and heads where the pump and its system meet, at speeds in rpm.
fn operating_points(law: &str, settings: &[&str], speeds: &[f64], level: f64) -> Vec<(f64, f64)> {
    let system = model("subsea_pump.dgd", &[law], settings);
    let n = speeds.len();
    let times = steps(0.0, (n - 1) as f64, n - 1);
    let rates: Vec<f64> = speeds.iter().map(|speed| speed * PI / 30.0).collect();
    let (zeros, levels) = (vec![0.0; n], vec![level; n]);
    let inputs = [("q", &zeros[..]), ("n", &rates), ("h_r", &levels)];
    let run = run(&system, &times, &inputs, &times, 1e-11);
    run.output("q_op").into_iter().zip(run.output("h_op")).collect()
}

#[test]
fn the_operating_point_is_where_the_curves_intersect() {
    let speeds = [1000.0, 1200.0, 1400.0, 1600.0, 1800.0, 2000.0];
    let (c0, c2, f1, f2, level) = (275.0, 9.0e3, 2e6, 1.75e8, 50.0);
    let lift = 302.0 - (307.0 - level);
    let asked = |q: f64| lift + (f1 * q + f2 * q * q) / (RHO * G);
    // Impeller of 250 mm, blades of 25 mm at 30 degrees, 2000 rpm (C.3).
    let full = 2000.0 * PI / 30.0;
    let theory0 = (0.25 * full).powi(2) / G;
    let theory1 = full / (30_f64.to_radians().tan() * 2.0 * PI * 0.025 * G);
    for (law, settings, shut_off, exponent, slope) in [
        ("pump.law=square", &["F1=2e6"][..], c0, 2.0, 0.0),
        ("pump.law=square", &["F1=2e6", "pump.c1=300"], c0, 2.0, 300.0),
        ("pump.law=power", &["F1=2e6", "pump.k=1.8"], c0, 1.8, 0.0),
        ("pump.law=theory", &["F1=2e6"], theory0, 2.0, theory1),
    ] {
        let found = operating_points(law, settings, &speeds, level);
        for (speed, (q, h)) in speeds.iter().zip(found) {
            let w: f64 = speed / 2000.0;
            let ideal = shut_off * w.powf(exponent);
            // a q^2 + b q = c, its positive root.
            let (a, b, c) = (c2 + f2 / (RHO * G), slope * w + f1 / (RHO * G), ideal - lift);
            let formula = 2.0 * c / (b + (b * b + 4.0 * a * c).sqrt());
            let too_much = |q: f64| asked(q) - (ideal - slope * w * q - c2 * q * q);
            assert_near(q, formula, 1e-9);
            assert_near(q, root_of(too_much, 0.0, 1.0), 1e-9);
            assert_near(h, asked(formula), 1e-9);
        }
    }
}

#[test]
fn a_pump_that_cannot_lift_the_mud_lets_it_run_back() {
    // At 500 rpm it lifts 275/16 = 17.2 m of the 45 m, and q|q| takes the other sign.
    let [(q, h)] = operating_points("pump.law=square", &[], &[500.0, 500.0], 50.0)[..1] else {
        panic!("one point")
    };
    let c = 45.0 - 275.0 / 16.0;
    assert_near(q, -(c / (9.0e3 + 1.75e8 / (RHO * G))).sqrt(), 1e-9);
    assert_near(h, 275.0 / 16.0 + 9.0e3 * q * q, 1e-9);
}

#[test]
fn performance_curves_have_the_shape_of_figure_2_3() {
    let curves = |law: &str, settings: &[&str]| {
        let system = model("subsea_pump.dgd", &[law], settings);
        let flows = [0.0, 0.1];
        let full = [2000.0 * PI / 30.0; 2];
        let inputs = [("q", &flows[..]), ("n", &full), ("h_r", &[50.0; 2])];
        let run = run(&system, &[0.0, 1.0], &inputs, &steps(0.0, 1.0, 100), 1e-6);
        let heads: Vec<Vec<f64>> = (1..=6).map(|i| run.output(&format!("head[{i}]"))).collect();
        heads
    };
    let square = curves("pump.law=square", &["pump.c1=300"]);
    for (i, head) in square.iter().enumerate() {
        let w = 0.5 + 0.1 * i as f64;
        // Shut-off head; at every flow below the vertex of the parabola that opens downwards, which
        // lies at -c1 w/(2 c2), with c1^2/(4 c2) w^2 above the shut-off head.
        assert_near(head[0], 275.0 * w * w, 1e-12);
        let (vertex, top) = (-300.0 * w / 1.8e4, (275.0 + 300.0 * 300.0 / 3.6e4) * w * w);
        for (k, found) in head.iter().enumerate() {
            let q = 1e-3 * k as f64;
            assert!((found - (top - 9.0e3 * (q - vertex).powi(2))).abs() < 1e-10, "{found}");
        }
    }
    // Affinity: at half of the speed, half of the flow at a quarter of the head.
    for k in 0..=50 {
        assert!((square[0][k] - 0.25 * square[5][2 * k]).abs() < 1e-10);
    }
    // With k = 2 the exponent changes nothing; with 1.8 all but full speed is lifted.
    let (plain, power) = (curves("pump.law=square", &[]), curves("pump.law=power", &[]));
    let flat = curves("pump.law=power", &["pump.k=1.8"]);
    for i in 0..6 {
        for k in 0..=100 {
            assert!((plain[i][k] - power[i][k]).abs() < 1e-10);
            let w: f64 = 0.5 + 0.1 * i as f64;
            let lifted = 275.0 * (w.powf(1.8) - w * w);
            assert!((flat[i][k] - plain[i][k] - lifted).abs() < 1e-9);
        }
    }
    // The theory is the square law with coefficients from the impeller; blades that stand straight
    // out give a head that only losses take from.
    let full = 2000.0 * PI / 30.0;
    let c0 = format!("pump.c0={:?}", (0.25 * full).powi(2) / G);
    let c1 = full / (30_f64.to_radians().tan() * 2.0 * PI * 0.025 * G);
    let c1 = format!("pump.c1={c1:?}");
    let theory = curves("pump.law=theory", &[]);
    let lumped = curves("pump.law=square", &[&c0, &c1]);
    let straight = curves("pump.law=theory", &["pump.beta_2=90"]);
    for i in 0..6 {
        for k in 0..=100 {
            assert!((theory[i][k] - lumped[i][k]).abs() < 1e-10);
            let q = 1e-3 * k as f64;
            assert!((straight[i][0] - straight[i][k] - 9.0e3 * q * q).abs() < 1e-10);
        }
    }
}
