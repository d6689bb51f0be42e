//! Models with arrays of several indices and arrays of parameters, against closed forms and against
//! exponentials of matrices by SciPy.

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::InterpretedSystem;
use dgd_runtime::{InputColumn, Inputs, Observations, Options, Problem, System, observe, simulate};

use crate::support::{compiled_text, root};

const CELSIUS: f64 = 273.15;
const HOUR: f64 = 3600.0;

/// Outputs of a run by name.
struct Run {
    names: Vec<String>,
    observations: Observations,
}

impl Run {
    /// At the k-th of the times that were asked for, behind the start.
    fn at(&self, name: &str, k: usize) -> f64 {
        let i = self.names.iter().position(|other| other == name).expect("an output");
        self.observations.w(k + 1)[i]
    }
}

/// A model of the repository with these settings, inputs in SI that are the same until a time, and
/// output at times.
fn run(name: &str, settings: &[&str], inputs: &[(f64, &[f64])], times: &[f64]) -> Run {
    let path = root().join("models").join(name);
    let text = std::fs::read_to_string(&path).expect("the model's file");
    let compiled = compiled_text(&path, text, (&[], settings), &SensitivityDirections::None);
    let system = InterpretedSystem::new(compiled.program);
    let signature = system.signature();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    // A jump is two rows of one time.
    let mut rows: Vec<(f64, &[f64])> = Vec::new();
    let mut from = 0.0;
    for (until, values) in inputs {
        rows.extend([(from, *values), (*until, *values)]);
        from = *until;
    }
    let at: Vec<f64> = rows.iter().map(|(t, _)| *t).collect();
    let values: Vec<Vec<f64>> =
        (0..signature.inputs.len()).map(|i| rows.iter().map(|(_, row)| row[i]).collect()).collect();
    let columns: Vec<InputColumn<'_>> = (signature.inputs.iter().zip(&values))
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    let inputs = Inputs::recorded(&at, &columns).expect("sound inputs");
    let options = Options { rtol: 1e-9, atol: 1e-10, ..Options::default() };
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times: Vec<f64> = [0.0].iter().chain(times).copied().collect();
    let solution = simulate(&problem, &times, &options).expect("a solution");
    let observations = observe(&problem, &solution);
    let names = signature.outputs.iter().map(|output| output.name.to_string()).collect();
    Run { names, observations }
}

/// What steps with a relative tolerance of 1e-9 err by, with a factor for their number.
const CLOSE: f64 = 1e-6;

fn close(what: &str, found: f64, expected: f64) {
    let allowed = CLOSE * expected.abs().max(1.0);
    assert!((found - expected).abs() <= allowed, "{what}: {found} instead of {expected}");
}

#[test]
fn compartments_follow_the_exponential_of_their_matrix() {
    // SciPy: expm([[A, b], [0, 0]] t) with A = kᵀ − diag(Σⱼ kᵢⱼ) − diag(k_out), m in mg.
    let expected = [
        [22.022_439_32, 37.62083, 25.719_455_95],
        [13.408_546_08, 22.323_148_8, 43.238_929_06],
        [3.271_613_7, 5.378_479_67, 30.486_390_8],
    ];
    let mg_per_hour = |dose: [f64; 3]| dose.map(|x| x * 1e-6 / HOUR);
    let (on, off) = (mg_per_hour([4.0, 0.0, 1.0]), mg_per_hour([0.0; 3]));
    let times = [2.0 * HOUR, 8.0 * HOUR, 24.0 * HOUR];
    let run = run("compartments.dgd", &[], &[(times[1], &on), (times[2], &off)], &times);
    for (k, masses) in expected.iter().enumerate() {
        for (i, expected) in masses.iter().enumerate() {
            // SciPy's digits end at 1e-8 mg.
            let found = 1e6 * run.at(&format!("m[{}]", i + 1), k);
            assert!((found - expected).abs() <= 1e-6, "m[{}]: {found}, {expected}", i + 1);
        }
        let total: f64 = masses.iter().sum();
        close("in the body", 1e6 * run.at("in_body", k), total);
    }
}

#[test]
fn a_plate_follows_the_exponential_of_its_matrix() {
    // SciPy: expm of the 48 balances with the flows put in, T in °C at [1][4], [3][2], [6][8]; the mean.
    let expected = [
        [65.397_115_319, 40.913_003_858, 28.885_997_697, 40.987_217_690],
        [137.928_050_990, 112.866_468_426, 99.620_931_150, 112.664_398_563],
    ];
    let inputs = [1.0, 2.0, 3.0, 4.0, 4.0, 3.0, 2.0, 1.0, 15.0 + CELSIUS];
    // T_air is a scalar, and comes before the elements of P.
    let mut ordered = inputs.to_vec();
    ordered.rotate_right(1);
    let run = run("heated_plate.dgd", &[], &[(600.0, &ordered)], &[100.0, 600.0]);
    for (k, expected) in expected.iter().enumerate() {
        for (name, expected) in ["T[1][4]", "T[3][2]", "T[6][8]", "T_mean"].iter().zip(expected) {
            close(name, run.at(name, k) - CELSIUS, *expected);
        }
        let far: f64 = (1..=8).map(|j| run.at(&format!("T[6][{j}]"), k)).sum();
        close("T_far", run.at("T_far", k), far / 8.0);
    }
}

/// A plate whose edges stay at 0: T = sin(π i/(N + 1)) sin(π j/(M + 1)) fades with the rate
/// −4 a (sin²(π/2(N + 1)) + sin²(π/2(M + 1))), exactly.
#[test]
fn a_mode_of_a_plate_fades_by_its_own_rate() {
    let text = "\
model plate
size N = 7
size M = 5
constant a [1/s] = 0.3
state T[i in 0..N+1][j in 0..M+1] = sin(pi*i/(N + 1))*sin(pi*j/(M + 1))
for j in 0..M+1 {
  equation north[j]: der(T[0][j]) = 0
  equation south[j]: der(T[N+1][j]) = 0
}
for i in 1..N {
  equation west[i]: der(T[i][0]) = 0
  equation east[i]: der(T[i][M+1]) = 0
}
for i in 1..N, j in 1..M {
  let across[i][j] = T[i-1][j] - 2*T[i][j] + T[i+1][j]
  let along[i][j]  = T[i][j-1] - 2*T[i][j] + T[i][j+1]
  equation inner[i][j]: der(T[i][j]) = a*(across[i][j] + along[i][j])
}
output T
";
    let system = crate::arrays::interpreted(text);
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &[], inputs: &inputs, start: &[] };
    let options = Options { rtol: 1e-10, atol: 1e-12, ..Options::default() };
    let solution = simulate(&problem, &[0.0, 3.0], &options).expect("a solution");
    let observations = observe(&problem, &solution);
    let half = |n: f64| (std::f64::consts::PI / (2.0 * n)).sin().powi(2);
    let factor = (-4.0 * 0.3 * (half(8.0) + half(6.0)) * 3.0_f64).exp();
    for (before, after) in observations.w(0).iter().zip(observations.w(1)) {
        assert!((after - factor * before).abs() <= 1e-8, "{after} of {before}, {factor}");
    }
}

/// The duty of one shell and two passes: ε = 2/(1 + C + S coth(NTU S/2)), S = √(1 + C²), by Kays and London.
/// Cells of length 1/N err by 1/N: twice the error is taken off.
#[test]
fn an_exchanger_has_the_effectiveness_of_its_passes() {
    let inputs = [2.0, 3.0, 20.0 + CELSIUS, 80.0 + CELSIUS];
    let (c_t, c_s) = (2.0 * 4180.0, 3.0 * 2100.0_f64);
    let (least, ratio) = (c_s, c_s / c_t);
    let ntu = 6000.0 / least;
    let s = (1.0 + ratio * ratio).sqrt();
    let effectiveness = 2.0 / (1.0 + ratio + s / (0.5 * ntu * s).tanh());
    let duty = |n: usize| {
        let settings = ["passes=2".to_owned(), format!("N={n}")];
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        let run = run("tube_passes.dgd", &settings, &[(20_000.0, &inputs)], &[20_000.0]);
        let heat = run.at("duty", 0);
        close("the heat of the tubes", c_t * (run.at("T_t_out", 0) - inputs[2]), heat);
        heat / (least * 60.0)
    };
    let (coarse, fine) = (duty(20), duty(40));
    let extrapolated = 2.0 * fine - coarse;
    let second_order = (1.0 / 40.0_f64).powi(2);
    assert!(
        (extrapolated - effectiveness).abs() <= second_order,
        "{extrapolated}, {effectiveness}"
    );
    assert!((fine - effectiveness).abs() > second_order, "the grid can be told from none");
}

#[test]
fn an_exchanger_of_four_passes_follows_the_exponential_of_its_matrix() {
    // SciPy: expm of the 100 balances, in °C.
    let expected = [
        (35.229_145_471, 60.195_573_398, 31.330_812_493),
        (41.784_129_574, 51.136_007_604, 32.350_440_959),
    ];
    let inputs = [2.0, 3.0, 20.0 + CELSIUS, 80.0 + CELSIUS];
    let run = run("tube_passes.dgd", &[], &[(60.0, &inputs)], &[15.0, 60.0]);
    for (k, (tubes, shell, end)) in expected.into_iter().enumerate() {
        close("T_t_out", run.at("T_t_out", k) - CELSIUS, tubes);
        close("T_s_out", run.at("T_s_out", k) - CELSIUS, shell);
        close("T_end", run.at("T_end", k) - CELSIUS, end);
    }
}

#[test]
fn a_battery_is_its_cells_one_by_one() {
    is_its_cells_one_by_one("battery_pack.dgd");
}

#[test]
fn a_battery_of_parts_is_its_cells_one_by_one() {
    is_its_cells_one_by_one("pack_of_cells.dgd");
}

/// At a constant current charges fall along lines, and voltages over capacitances are I R₁ (1 − e^(−t/R₁C₁)).
#[track_caller]
fn is_its_cells_one_by_one(model: &str) {
    let capacities = [2.5, 2.5, 2.4, 2.5, 2.55, 2.5].map(|q| q * HOUR);
    let resistances = [20.0, 21.0, 26.0, 20.0, 19.0, 20.0].map(|r| 1e-3 * r);
    let capacitances = [2500.0, 2400.0, 2000.0, 2500.0, 2600.0, 2500.0];
    let (current, r_1) = (2.0, 0.012);
    // SciPy's DOP853 with a tolerance of 1e-11, in °C.
    let hottest = [23.028_651_540, 22.253_078_887];
    let inputs = [current, 20.0 + CELSIUS];
    let times = [600.0, 1200.0];
    let run = run(model, &[], &[(1200.0, &inputs)], &times);
    for (k, t) in times.into_iter().enumerate() {
        let left = |i: usize| 0.8 - current * t / capacities[i];
        let voltage = |i: usize| {
            // Between the points at 0.5 and at 0.9 of the table.
            let open = 3.7 + (left(i) - 0.5) * (4.05 - 3.7) / 0.4;
            let branch = current * r_1 * (1.0 - (-t / (r_1 * capacitances[i])).exp());
            open - resistances[i] * current - branch
        };
        let all: Vec<f64> = (0..6).map(voltage).collect();
        close("V", run.at("V", k), all.iter().sum());
        close("lowest", run.at("lowest", k), all.iter().copied().fold(f64::MAX, f64::min));
        close("left", run.at("left", k), (0..6).map(left).fold(f64::MAX, f64::min));
        close("T_max", run.at("T_max", k) - CELSIUS, hottest[k]);
    }
}

/// A room that is heated or not nears one of two temperatures, until its thermostat acts.
#[test]
fn rooms_go_up_and_down_between_their_thermostats_limits() {
    let (outside, r, p) = (-5.0, 20.0, 2.0);
    let (low, high) = (19.0, 21.0);
    let room = |n: f64, t: f64| {
        let tau = r * 600.0 * (1.0 + 0.5 * (n - 1.0) / 20.0);
        let (mut since, mut from, mut on) = (0.0, 19.0 + 2.0 * (n - 0.5) / 20.0, true);
        loop {
            let (far, next) = if on { (outside + r * p, high) } else { (outside, low) };
            let at = since + tau * ((from - far) / (next - far)).ln();
            if at > t {
                return (far + (from - far) * (-(t - since) / tau).exp(), on);
            }
            (since, from, on) = (at, next, !on);
        }
    };
    let times = [1000.0, 7200.0, 86_400.0];
    let run = run("heated_rooms.dgd", &[], &[(1e5, &[outside + CELSIUS])], &times);
    for (k, t) in times.into_iter().enumerate() {
        let all: Vec<(f64, bool)> = (1..=20).map(|n| room(f64::from(n), t)).collect();
        let on = all.iter().filter(|(_, on)| *on).count();
        assert!((1..20).contains(&on), "some are heated");
        close("power", run.at("power", k), 1e3 * p * on as f64);
        for (n, (temperature, _)) in all.iter().enumerate() {
            close("T", run.at(&format!("room.T[{}]", n + 1), k) - CELSIUS, *temperature);
        }
        let lowest = all.iter().map(|(temperature, _)| *temperature).fold(f64::MAX, f64::min);
        close("lowest", run.at("T_lowest", k) - CELSIUS, lowest);
    }
}

/// What a house gets left the plant a while ago, and has lost heat to the ground and to the houses before.
#[test]
fn water_arrives_late_and_colder() {
    const GROUND: f64 = 8.0;
    const LATE: [f64; 5] = [120.0, 60.0, 240.0, 90.0, 180.0];
    const POWER: [f64; 5] = [50.0, 80.0, 40.0, 60.0, 100.0];
    /// At the i-th house, °C.
    fn arriving(i: usize, t: f64) -> f64 {
        let Some(before) = i.checked_sub(1) else {
            return if t < 0.0 {
                80.0
            } else if t < 300.0 {
                75.0
            } else {
                90.0
            };
        };
        if t < 0.0 {
            return 80.0;
        }
        let kept = (-0.08 / HOUR * LATE[before]).exp();
        let cooled = GROUND + (arriving(before, t - LATE[before]) - GROUND) * kept;
        cooled - POWER[before] / (10.0 * 4.19)
    }
    let times = [100.0, 350.0, 500.0, 800.0, 1200.0];
    let of_plant = |celsius: f64| [celsius + CELSIUS, GROUND + CELSIUS];
    let (cold, hot) = (of_plant(75.0), of_plant(90.0));
    let run = run("heating_main.dgd", &[], &[(300.0, &cold), (2000.0, &hot)], &times);
    for (k, t) in times.into_iter().enumerate() {
        for i in 0..=5 {
            close("T", run.at(&format!("T[{i}]"), k) - CELSIUS, arriving(i, t));
        }
        close("T_end", run.at("T_end", k) - CELSIUS, arriving(5, t));
    }
}
