//! The full well of the thesis, `models/dual_gradient_drilling.dgd`, and the hybrid of its section 2.5,
//! `models/u_tube_drill_string.dgd`: against closed forms, balances by hand, and the equations of the
//! page written down once more and integrated by another method.

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, Observations, Options, Problem, Solution, System, observe, simulate,
};

use crate::exact;
use crate::support;
use crate::support::{compiled_text, root};

const G: f64 = 9.81;
const RHO: f64 = 1120.0;
const P_ATM: f64 = 101_325.0;
const LPM: f64 = 1e-3 / 60.0;
const INCH: f64 = 0.0254;
const BAR: f64 = 1e5;
/// Drill string: bit, and what presses a line together.
const L_BIT: f64 = 2500.0;
const BETA: f64 = 15_000.0 * BAR;
const P_VAPOUR: f64 = -0.99 * BAR;

fn circle(diameter_in_inches: f64) -> f64 {
    std::f64::consts::PI / 4.0 * (diameter_in_inches * INCH).powi(2)
}

/// Cross-sections of the drill string, of riser and hole around the drill pipe, of the booster line.
fn a_d() -> f64 {
    circle(4.276)
}
fn a_r() -> f64 {
    circle(19.75) - circle(5.0)
}
fn a_a() -> f64 {
    circle(9.76) - circle(5.0)
}
fn a_b() -> f64 {
    0.0103
}

/// A model of the repository with values of parameters, constants or states that are not its own.
fn model(name: &str, settings: &[&str]) -> InterpretedSystem {
    let path = root().join("models").join(name);
    let text = std::fs::read_to_string(&path).expect("the model's file");
    let compiled = compiled_text(&path, text, (&[], settings), &SensitivityDirections::None);
    InterpretedSystem::new(compiled.program)
}

/// Samples of all inputs at one time: flows in lpm, the rest in SI.
type Row<const N: usize> = (f64, [f64; N]);

/// A recording of the examples, whose columns are the inputs in their order.
fn recorded<const N: usize>(name: &str, to_si: impl Fn([f64; N]) -> [f64; N]) -> Vec<Row<N>> {
    let text = std::fs::read_to_string(root().join("examples/data").join(name));
    let text = text.expect("a recording");
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.map(|line| {
        let mut cells = line.split(',').map(|cell| cell.parse().expect("a number"));
        let time: f64 = cells.next().expect("a time");
        let cells: Vec<f64> = cells.collect();
        (time, to_si(cells.try_into().expect("all inputs")))
    })
    .collect()
}

struct Run {
    solution: Solution,
    observations: Observations,
    unknowns: Vec<String>,
    outputs: Vec<String>,
}

impl Run {
    /// An unknown at the k-th time, SI.
    fn unknown(&self, name: &str, k: usize) -> f64 {
        let at = self.unknowns.iter().position(|known| known == name).expect("an unknown");
        self.solution.y(k)[at]
    }

    /// An output at the k-th time, SI.
    fn output(&self, name: &str, k: usize) -> f64 {
        let at = self.outputs.iter().position(|known| known == name).expect("an output");
        self.observations.w[k * self.observations.n_w + at]
    }

    fn outputs(&self, name: &str) -> Vec<f64> {
        (0..self.solution.len()).map(|k| self.output(name, k)).collect()
    }

    /// Times at which an automaton left a mode for another one.
    fn switches(&self, automaton: &str) -> Vec<(f64, &str)> {
        let events = self.solution.events.iter().filter(|event| event.automaton == automaton);
        events.map(|event| (event.t, event.to.as_ref())).collect()
    }
}

fn inputs<const N: usize>(system: &InterpretedSystem, rows: &[Row<N>]) -> Inputs {
    let times: Vec<f64> = rows.iter().map(|(t, _)| *t).collect();
    let declared = &system.signature().inputs;
    assert_eq!(declared.len(), N);
    let values: Vec<Vec<f64>> = declared
        .iter()
        .enumerate()
        .map(|(i, input)| {
            let factor = if &*input.unit.symbol == "lpm" { LPM } else { 1.0 };
            rows.iter().map(|(_, row)| factor * row[i]).collect()
        })
        .collect();
    let columns: Vec<InputColumn<'_>> = declared
        .iter()
        .zip(&values)
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    Inputs::recorded(&times, &columns).expect("sound inputs")
}

fn run<const N: usize>(
    system: &InterpretedSystem,
    rows: &[Row<N>],
    times: &[f64],
    rtol: f64,
) -> Run {
    run_from(system, rows, times, rtol, &[])
}

/// Runs with start values of some unknowns replaced.
fn run_from<const N: usize>(
    system: &InterpretedSystem,
    rows: &[Row<N>],
    times: &[f64],
    rtol: f64,
    start: &[(&str, f64)],
) -> Run {
    let signature = system.signature();
    let unknowns: Vec<String> = signature.unknowns.iter().map(|x| x.name.into_owned()).collect();
    let start: Vec<(usize, f64)> = start
        .iter()
        .map(|(name, value)| {
            (unknowns.iter().position(|known| known == name).expect("an unknown"), *value)
        })
        .collect();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    let inputs = inputs(system, rows);
    let problem = Problem { system, p: &p, inputs: &inputs, start: &start };
    let options = Options { rtol, atol: rtol, ..Options::default() };
    let solution = simulate(&problem, times, &options).expect("a run");
    let observations = observe(&problem, &solution);
    let outputs = signature.outputs.iter().map(|output| output.name.to_string()).collect();
    Run { solution, observations, unknowns, outputs }
}

fn seconds(last: u32) -> Vec<f64> {
    (0..=last).map(f64::from).collect()
}

#[track_caller]
fn assert_near(found: f64, expected: f64, off: f64) {
    assert!((found - expected).abs() <= off, "{found} is not {expected} within {off:e}");
}

// The drill string: inputs q_p, disconnected, q_boost, q_ssp.

/// The rig pump stops within half a minute, the string is opened, closed, and filled up again.
const STOP_OPEN_START: [Row<4>; 8] = [
    (0.0, [2000.0, 0.0, 0.0, 2000.0]),
    (60.0, [2000.0, 0.0, 0.0, 2000.0]),
    (90.0, [0.0, 0.0, 0.0, 0.0]),
    (3600.0, [0.0, 1.0, 0.0, 0.0]),
    (7200.0, [0.0, 0.0, 0.0, 0.0]),
    (7260.0, [0.0, 0.0, 0.0, 0.0]),
    (7320.0, [2000.0, 0.0, 0.0, 2000.0]),
    (9000.0, [2000.0, 0.0, 0.0, 2000.0]),
];

#[test]
fn columns_at_rest_are_equal() {
    let h_0 = 150.0;
    for (rho_d, rho_a) in [(1120.0, 1120.0), (1150.0, 1120.0), (1100.0, 1120.0)] {
        let set = [format!("rho_d={rho_d}"), format!("rho_a={rho_a}"), format!("h_0={h_0}")];
        let system = model("u_tube_drill_string.dgd", &set.each_ref().map(String::as_str));
        let run = run(&system, &STOP_OPEN_START, &[0.0, 3599.0, 7199.0, 9000.0], 1e-9);

        // Standpipe at 2000 lpm: friction 1.5e7 q + (4e9 + 6e9) q², less the heavier column inside.
        let q = 2000.0 * LPM;
        let heavier = G * (rho_a * (L_BIT - h_0) - rho_d * L_BIT);
        let p_steady = 1.5e7 * q + 1e10 * q * q + heavier;
        assert_near(run.output("string.p", 0), p_steady, 1e-6);

        // At rest, sealed at the vapour pressure and then open: rho_d x = rho_a h + Δrho l + p/g, and
        // what left the string is in the riser: A_r (h_0 − h) = A_d x + V/β (p_steady − p).
        for (k, p) in [(1, P_VAPOUR), (2, 0.0)] {
            let column = (rho_d - rho_a) * L_BIT + p / G;
            let released = a_d() * L_BIT / BETA * (p_steady - p);
            let h =
                (a_r() * h_0 - released - a_d() * column / rho_d) / (a_r() + a_d() * rho_a / rho_d);
            let x = (rho_a * h + column) / rho_d;
            // Oscillations about it have died out: an hour is sixty times 2 M/F1, 56 s.
            assert_near(run.output("riser.h", k), h, 1e-6);
            assert_near(run.output("string.x", k), x, 1e-6);
            assert_near(run.output("string.p", k), p, 1e-3);
            assert_near(run.output("string.q", k), 0.0, 1e-9);
        }
        // Full again, and all as it was.
        assert_near(run.output("string.x", 3), 0.0, 0.0);
        assert_near(run.output("riser.h", 3), h_0, 1e-6);
        assert_near(run.output("string.p", 3), p_steady, 10.0);
        let modes: Vec<&str> = run.switches("string.top").iter().map(|(_, to)| *to).collect();
        assert_eq!(modes, ["level", "full"]);
    }
}

#[test]
fn switching_times_converge_with_the_tolerance() {
    let system = model("u_tube_drill_string.dgd", &[]);
    let rows = recorded("u_tube.csv", |row: [f64; 4]| row);
    let times = |rtol: f64| -> Vec<f64> {
        let run = run(&system, &rows, &[0.0, 1800.0], rtol);
        run.switches("string.top").iter().map(|(t, _)| *t).collect()
    };
    let exact = times(1e-12);
    // Mud parts from the top while the pump ramps down, and is back soon after it is at full flow.
    assert!((60.0..90.0).contains(&exact[0]) && (1320.0..1360.0).contains(&exact[1]), "{exact:?}");
    let off = |rtol: f64| {
        let found = times(rtol);
        assert_eq!(found.len(), exact.len());
        found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let (rough, medium, fine) = (off(1e-4), off(1e-6), off(1e-8));
    println!("switching times are off by {rough:.1e} s, {medium:.1e} s, {fine:.1e} s");
    // The time itself within the tolerance of the time scale, some 100 s; and with a tolerance that
    // is a hundred times smaller, at least twenty times closer.
    assert!(rough < 1e-4 * 100.0 && medium < rough / 20.0 && fine < medium / 20.0);
}

#[test]
fn sensitivities_go_through_the_modes() {
    let system = support::interpreted("models/u_tube_drill_string.dgd", &[]);
    let inputs = inputs(&system, &recorded("u_tube.csv", |row: [f64; 4]| row));
    // While the column falls, sealed; and when the string is full again, where its pressure rises.
    // The differences are good to some 1e-6 of themselves.
    exact::assert_slopes_are_differences(&system, &inputs, &[0.0, 300.0], 1e-4);
    exact::assert_slopes_are_differences(&system, &inputs, &[0.0, 1345.0], 1e-4);
}

#[test]
fn with_quadratic_friction_the_flow_of_a_falling_column_falls_linearly() {
    // F q² = ρ g u − M q̇, u = h − x + p_vp/(ρ g), u̇ = −q (1/A_d + 1/A_r): solved by
    // q̇ = −ρ g/(2 F) (1/A_d + 1/A_r), a constant, as long as M is one. With F this large the start
    // is forgotten after M/(F q) = 0.3 s, and M's own change adds ρ/A_d / (2 F A_d) = 7e-6 of it.
    let f = 1e12;
    let set = ["string.F1=0", "string.F2=0", "F_well=1e12"];
    let system = model("u_tube_drill_string.dgd", &set);
    let still = [(0.0, [0.0; 4]), (1500.0, [0.0; 4])];
    let run = run(&system, &still, &[0.0, 100.0, 700.0, 1300.0], 1e-9);
    let slope = -RHO * G / (2.0 * f) * (1.0 / a_d() + 1.0 / a_r());
    let q = run.outputs("string.q");
    for pair in q[1..].windows(2) {
        let found = (pair[1] - pair[0]) / 600.0;
        assert!((found / slope - 1.0).abs() < 1e-5, "{found:e} against {slope:e}");
    }
    // And the flow is that of the head at the time.
    let u = run.output("riser.h", 1) - run.output("string.x", 1) + P_VAPOUR / (RHO * G);
    assert!((q[1] / (RHO * G * u / f).sqrt() - 1.0).abs() < 1e-3);
}

#[test]
fn a_full_string_without_friction_swings_against_its_compressibility() {
    // V/β ṗ = q_p − q and M q̇ = p − p_end: q − q_p = a cos ω t, ω² = (β/V + ρ_a g/A_r)/M, and the
    // riser's level moves by 1 mm, which changes M by 2e-8 of it.
    let set = ["string.F1=0", "string.F2=0", "F_well=0", "rho_d=1100", "h_0=0", "riser.bottom=300"];
    let system = model("u_tube_drill_string.dgd", &set);
    let (flow, a) = (1000.0 * LPM, 1e-4);
    let steady = [(0.0, [1000.0, 0.0, 0.0, 1000.0]), (40.0, [1000.0, 0.0, 0.0, 1000.0])];
    let times: Vec<f64> = (0..=400).map(|k| 0.1 * f64::from(k)).collect();
    let run = run_from(&system, &steady, &times, 1e-10, &[("string.q", flow + a)]);
    let inertia = 1100.0 * L_BIT / a_d() + RHO * (L_BIT - 300.0) / a_a() + RHO * 300.0 / a_r();
    let omega = ((BETA / (a_d() * L_BIT) + RHO * G / a_r()) / inertia).sqrt();
    for (k, t) in times.iter().enumerate() {
        assert_near(run.output("string.q", k), flow + a * (omega * t).cos(), 1e-6 * a);
    }
}

// The well: inputs q_p, q_boost, q_tf, disconnected, p_ref.

/// Pressure at the riser's sensor with the level at a depth.
fn sensor(level: f64) -> f64 {
    P_ATM + RHO * G * (305.0 - level)
}

/// The recording of a connection, with two hours of drilling behind it.
fn connection() -> Vec<Row<5>> {
    let mut rows =
        recorded("pipe_connection.csv", |row| [row[0], row[1], row[2], row[3], BAR * row[4]]);
    let (_, last) = rows[rows.len() - 1];
    rows.push((7200.0, last));
    rows
}

/// The booster pump is off for ten minutes with the level at 120 m.
fn booster_stop() -> Vec<Row<5>> {
    let row = |t, q_boost| (t, [2000.0, q_boost, 100.0, 0.0, sensor(120.0)]);
    vec![
        row(0.0, 1500.0),
        row(300.0, 1500.0),
        row(317.0, 0.0),
        row(900.0, 0.0),
        row(930.0, 1500.0),
        row(1800.0, 1500.0),
    ]
}

#[test]
fn no_mud_is_lost() {
    let cases = [
        ("connection", connection(), 0.0),
        ("booster", booster_stop(), 0.0),
        ("influx", connection(), 200.0),
    ];
    for (name, rows, influx) in cases {
        let set = [format!("q_res={influx}"), "t_res=400".to_owned()];
        let system = model("dual_gradient_drilling.dgd", &set.each_ref().map(String::as_str));
        let run = run(&system, &rows, &seconds(1800), 1e-6);
        let mud = run.outputs("mud");
        let mut worst: f64 = 0.0;
        for (k, found) in mud.iter().enumerate() {
            let came = influx * LPM * (run.solution.times[k] - 400.0).max(0.0);
            worst = worst.max((found - mud[0] - came).abs());
        }
        println!("{name}: {} m³ are kept to {worst:.1e} m³", mud[0]);
        // Whatever the tolerance: the sum is linear in the states, so that a step keeps it but for
        // rounding, some ulp of the largest, of 90 m³, each of less than two thousand steps.
        assert!(worst < 2000.0 * 90.0 * f64::EPSILON, "{name}: {worst:e} m³");
    }
}

#[test]
fn steady_pressures_are_those_of_the_hand_calculation() {
    // Two hours after the connection, with an influx of 200 lpm that began at its end.
    let system = model("dual_gradient_drilling.dgd", &["q_res=200", "t_res=1000"]);
    let run = run(&system, &connection(), &[0.0, 7200.0], 1e-9);
    let expected = |q_res: f64| {
        let (q_p, q_b) = (2000.0 * LPM, 1000.0 * LPM);
        let (q_a, q) = (q_p + q_res, q_p + q_b + 100.0 * LPM + q_res);
        let h = 50.0;
        // Annulus: 2e8 q_a² over the 2148 m from the wellhead to the bit.
        let f_a = 2e8 * q_a * q_a;
        let p_bit = RHO * G * (2500.0 - h) + f_a;
        let p_shoe = RHO * G * (1200.0 - h) + f_a * (1200.0 - 352.0) / 2148.0;
        // Inside: bit 6e9 q², string 1.5e7 q + 4e9 q².
        let p_inside = p_bit + 6e9 * q_p * q_p;
        let standpipe = p_inside + 1.5e7 * q_p + 4e9 * q_p * q_p - RHO * G * 2500.0;
        let p_booster = 6e7 * q_b - RHO * G * h;
        // Pump: 275 w² − 9000 q² m of head lift the mud by h − 5 m against 1.75e8 q².
        let p_in = RHO * G * (307.0 - h);
        let p_out = RHO * G * 302.0 + 1.75e8 * q * q;
        let w = (((p_out - p_in) / (RHO * G) + 9000.0 * q * q) / 275.0).sqrt();
        [
            ("riser.h", h, 1.0),
            ("line.q", q, 0.1),
            ("p_r", sensor(h), BAR),
            ("p_bit", p_bit, BAR),
            ("p_shoe", p_shoe, BAR),
            ("p_inside_bit", p_inside, BAR),
            ("string.p", standpipe, BAR),
            ("booster.p", p_booster, BAR),
            ("p_in", p_in, BAR),
            ("p_out", p_out, BAR),
            ("w", w, 1.0),
        ]
    };
    for (k, q_res) in [(0, 0.0), (1, 200.0 * LPM)] {
        for (name, value, size) in expected(q_res) {
            let found = run.output(name, k);
            // What is left after 6200 s of the slowest part of the control, of some 100 s.
            assert!((found - value).abs() < 1e-7 * size, "{name}: {found} is not {value}");
        }
    }
    // In numbers: 112.84 bar at the standpipe, 271.41 bar at the bit, 63.69 % of full speed.
    assert_near(run.output("string.p", 0) / BAR, 112.84, 0.005);
    assert_near(run.output("p_bit", 0) / BAR, 271.41, 0.005);
    assert_near(run.output("w", 0), 0.6369, 5e-5);
}

#[test]
fn it_starts_steady_with_any_pump() {
    for set in [&["pump.c1=300"][..], &["pump.c1=0", "pump.c2=2e4", "line.F1=1e6"]] {
        let system = model("dual_gradient_drilling.dgd", set);
        let run = run(&system, &connection(), &[0.0, 299.0], 1e-8);
        for (name, size) in [("riser.h", 1.0), ("line.q", 0.05), ("w", 1.0), ("string.p", BAR)] {
            let (start, later) = (run.output(name, 0), run.output(name, 1));
            assert!((start - later).abs() < 1e-8 * size, "{set:?}: {name}, {start} and {later}");
        }
    }
}

#[test]
fn a_pipe_connection_goes_as_on_the_rig() {
    let system = model("dual_gradient_drilling.dgd", &[]);
    let run = run(&system, &connection(), &seconds(1800), 1e-8);
    let at = |name: &str, t: usize| run.output(name, t);

    // The standpipe falls to the vapour pressure before the pump stands still, is at the air's as
    // soon as the string is open, and is back when the string is full again.
    let switches = run.switches("string.top");
    assert!(
        matches!(switches[..], [(a, "level"), (b, "full")]
        if (320.0..330.0).contains(&a) && (930.0..960.0).contains(&b)),
        "{switches:?}"
    );
    assert_near(at("string.p", 385), P_VAPOUR, 1.0);
    assert_near(at("string.p", 400), 0.0, 10.0);
    assert!((at("string.p", 1800) / at("string.p", 0) - 1.0).abs() < 1e-5);

    // The flow through the bit goes on for minutes, gushes when air comes in, and dies away; the
    // string's level comes to that of the riser.
    assert!(at("string.q", 340) > 200.0 * LPM);
    assert!(at("string.q", 394) > at("string.q", 389));
    assert!(at("string.q", 830).abs() < 1.0 * LPM);
    assert_near(at("string.x", 830), at("riser.h", 830), 0.1);

    // The control slows the pump down to what still flows in, and keeps the level within 3 m.
    assert!(at("w", 830) < 0.45 && at("w", 0) > 0.63);
    assert!((at("line.q", 830) / (1100.0 * LPM) - 1.0).abs() < 0.01);
    let level = run.outputs("riser.h");
    let (lowest, highest) =
        level.iter().fold((50.0_f64, 50.0_f64), |(low, high), h| (low.min(*h), high.max(*h)));
    assert!(lowest > 47.0 && lowest < 48.0 && highest < 53.0 && highest > 52.0, "{level:?}");

    // The bottom of the hole loses the annulus' friction, 2.2 bar, and what the level is off.
    let lost = at("p_bit", 0) - at("p_bit", 830);
    assert_near(lost, 2e8 * (2000.0 * LPM).powi(2) + RHO * G * (level[830] - 50.0), 100.0);
    // The pits have what the string lost: A_d x, and what its mud and that of the booster expanded.
    let pit = at("pit", 830);
    let string = a_d() * at("string.x", 830)
        + a_d() * L_BIT / BETA * (at("string.p", 0) - at("string.p", 830));
    let booster = a_b() * 340.0 / BETA * (at("booster.p", 0) - at("booster.p", 830));
    assert_near(pit, string + booster + a_r() * (level[830] - 50.0), 1e-9);
}

#[test]
fn the_booster_line_drains_to_the_risers_level() {
    let system = model("dual_gradient_drilling.dgd", &[]);
    let run = run(&system, &booster_stop(), &seconds(1800), 1e-8);
    // Its friction holds the column, 6e7 q = ρ g h_r, at 1318 lpm, 2 s after the pump begins to stop.
    // With time constant τ = F1 A_b/(ρ g) = 56 s its level goes to the riser's, and once the pump
    // runs to h_r − F1 q/(ρ g) = −16.5 m: it is full after τ ln(136.5/16.5) = 119 s, since the middle
    // of the pump's ramp, and 3 s earlier or later for each metre that the riser's level is off.
    let switches = run.switches("booster.top");
    assert!(
        matches!(switches[..], [(a, "level"), (b, "full")]
        if (301.0..303.0).contains(&a) && (1027.0..1041.0).contains(&b)),
        "{switches:?}"
    );
    assert!((run.output("booster.x", 900) / run.output("riser.h", 900) - 1.0).abs() < 0.01);
    // Its mud goes on coming when the pump stands.
    assert!(run.output("booster.q", 330) > 800.0 * LPM);
}

#[test]
fn the_controller_does_not_wind_up() {
    // The level is to go from 50 m to 200 m, for which the pump needs 20 minutes at full speed.
    let system = model("dual_gradient_drilling.dgd", &[]);
    let row = |t, level| (t, [2000.0, 1000.0, 100.0, 0.0, sensor(level)]);
    let rows = [row(0.0, 50.0), row(60.0, 200.0), row(3600.0, 50.0), row(7200.0, 50.0)];
    let run = run(&system, &rows, &seconds(7200), 1e-8);
    let level = run.outputs("riser.h");
    let sums: Vec<f64> = (0..=7200).map(|k| run.unknown("control.sum", k)).collect();
    // What the controller asks for: 5 %/m, 100 s.
    let asked = |k: usize| {
        let error = (sensor(level[k]) - sensor(if k < 3600 { 200.0 } else { 50.0 })) / (RHO * G);
        0.5 + 0.05 * (error + sums[k] / 100.0)
    };

    // Beyond a limit, at both ends of a second, nothing is summed up. At the limit itself the sum
    // goes just as fast as keeps it there.
    let (mut high, mut low) = (0, 0);
    for k in 61..7200 {
        let both = [asked(k), asked(k + 1)];
        if both.iter().all(|asked| *asked > 1.0 + 1e-6) {
            assert_eq!(sums[k], sums[k + 1], "at {k} s");
            high += 1;
        } else if both.iter().all(|asked| *asked < -1e-6) {
            assert_eq!(sums[k], sums[k + 1], "at {k} s");
            low += 1;
        }
    }
    println!("above the limit for {high} s, below it for {low} s");
    assert!(high > 1200 && low > 400);
    // So that it stops where it should: a sum of 20 minutes would overshoot by tens of metres.
    let highest = level.iter().copied().fold(0.0, f64::max);
    let lowest = level[3600..].iter().copied().fold(f64::INFINITY, f64::min);
    assert!(highest < 200.1 && lowest > 49.5, "{highest} {lowest}");
    assert_near(level[3600], 200.0, 1e-3);
    assert_near(level[7200], 50.0, 1e-3);
    // The valve keeps the mud in the return line while the pump stands.
    assert!(run.outputs("line.q").iter().all(|q| *q > -1e-6));
    assert_near(run.output("line.q", 3800), 0.0, 1e-12);
}

// The page once more, by Runge and Kutta's method with small steps.

/// p and x of string and booster, their flows, riser level, return flow, sum and speed.
type State = [f64; 10];

#[derive(Clone, Copy, PartialEq, Debug)]
struct Levels {
    string: bool,
    booster: bool,
}

/// Input flows and whether the string is open, at a time, of the connection or the booster's stop.
fn given(rows: &[Row<5>], t: f64, held_since: f64) -> [f64; 5] {
    let next = rows.iter().position(|(end, _)| *end > held_since).unwrap_or(rows.len() - 1);
    let ((t0, a), (t1, b)) = (rows[next - 1], rows[next]);
    let share = (t - t0) / (t1 - t0);
    let linear = |i: usize| LPM * (a[i] + share * (b[i] - a[i]));
    [linear(0), linear(1), LPM * a[2], a[3], a[4]]
}

/// ẏ of section 2.2 to 2.5 with the sizes of the model.
fn rates(y: &State, [q_p, q_boost, q_tf, z, p_ref]: [f64; 5], level: Levels) -> State {
    let [p_d, x_d, q_bit, p_b, x_b, q_bo, h_r, q_ssp, sum, w] = *y;
    let riser = |l: f64| RHO * (l - h_r) / a_r();

    // 2.10 and 2.11, or ẋ = (q_out − q_in)/A and ṗ = K z (p_0 − p), K = 1/s; mud that is pressed
    // together makes room.
    let line = |p: f64, x_of: f64, q: f64, q_in: f64, area: f64, z: f64, empties: bool| {
        let compressibility = area * x_of / BETA;
        if empties {
            let rise = z * (0.0 - p);
            (rise, (q - q_in + compressibility * rise) / area)
        } else {
            ((q_in - q) / compressibility, 0.0)
        }
    };
    let (dp_d, dx_d) = line(p_d, L_BIT, q_bit, q_p, a_d(), z, level.string);
    let (dp_b, dx_b) = line(p_b, 340.0, q_bo, q_boost, a_b(), 1.0, level.booster);

    // 2.20: M(h_r) q̇ = p_p − p_0 − F + G.
    let m = RHO * (L_BIT - x_d) / a_d() + RHO * (L_BIT - 352.0) / a_a() + riser(352.0);
    let f = 1.5e7 * q_bit + (4e9 + 6e9 + 2e8) * q_bit * q_bit.abs();
    let dq_bit = (p_d - f + RHO * G * (h_r - x_d)) / m;
    let m_b = RHO * (340.0 - x_b) / a_b() + riser(340.0);
    let dq_bo = (p_b - 6e7 * q_bo + RHO * G * (h_r - x_b)) / m_b;

    // 2.14, 2.21 with 2.27.
    let dh = (q_ssp - q_bit - q_bo - q_tf) / a_r();
    let head = 275.0 * w * w - 9.0e3 * q_ssp * q_ssp.abs();
    let net = RHO * G * (307.0 - h_r + head - 302.0) - 1.75e8 * q_ssp * q_ssp.abs();
    let dq_ssp = net / (riser(307.0) + RHO * 302.0 / circle(6.05));

    // 2.31 with 5 %/m and 100 s, 2.29. The command is never at a limit here.
    let error = (sensor(h_r) - p_ref) / (RHO * G);
    let command = 0.5 + 0.05 * (error + sum / 100.0);
    assert!((0.0..1.0).contains(&command));
    [dp_d, dx_d, dq_bit, dp_b, dx_b, dq_bo, dh, dq_ssp, error, (command - w) / 5.0]
}

fn runge_kutta(rows: &[Row<5>], y: &State, t: f64, h: f64, level: Levels) -> State {
    let plus = |k: &State, h: f64| -> State { std::array::from_fn(|i| y[i] + h * k[i]) };
    let f = |y: &State, c: f64| rates(y, given(rows, t + c, t), level);
    let k1 = f(y, 0.0);
    let k2 = f(&plus(&k1, 0.5 * h), 0.5 * h);
    let k3 = f(&plus(&k2, 0.5 * h), 0.5 * h);
    let k4 = f(&plus(&k3, h), h);
    std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}

/// The modes that a state asks for. A line is full again where its level is above the rig.
fn asked(rows: &[Row<5>], y: &State, t: f64, level: Levels) -> Levels {
    let threshold = if given(rows, t, t)[3] > 0.5 { 0.0 } else { P_VAPOUR };
    Levels {
        string: if level.string { y[1] >= 0.0 } else { y[0] < threshold },
        booster: if level.booster { y[4] >= 0.0 } else { y[3] < 0.0 },
    }
}

#[test]
fn the_equations_of_the_page_by_another_method_are_the_well() {
    const STEPS: u32 = 250;
    for (rows, last) in [(connection(), 1200), (booster_stop(), 1200)] {
        let system = model("dual_gradient_drilling.dgd", &[]);
        let run = run(&system, &rows, &seconds(last), 1e-10);
        let names = [
            "string.p",
            "string.x",
            "string.q",
            "booster.p",
            "booster.x",
            "booster.q",
            "riser.h",
            "line.q",
            "control.sum",
            "w",
        ];
        let mut y: State = names.map(|name| run.unknown(name, 0));
        let mut level = Levels { string: false, booster: false };
        let mut switches = 0;
        let mut worst = [0.0_f64; 10];
        for second in 0..last {
            for step in 0..STEPS {
                let mut t = f64::from(second) + f64::from(step) / f64::from(STEPS);
                let end = f64::from(second) + f64::from(step + 1) / f64::from(STEPS);
                loop {
                    let next = runge_kutta(&rows, &y, t, end - t, level);
                    if asked(&rows, &next, t, level) == level {
                        y = next;
                        break;
                    }
                    // Where it switches, by halving.
                    let (mut low, mut high) = (0.0, end - t);
                    while high - low > 1e-12 {
                        let middle = 0.5 * (low + high);
                        let there = runge_kutta(&rows, &y, t, middle, level);
                        if asked(&rows, &there, t, level) == level {
                            low = middle;
                        } else {
                            high = middle;
                        }
                    }
                    y = runge_kutta(&rows, &y, t, high, level);
                    t += high;
                    let before = level;
                    level = asked(&rows, &y, t, level);
                    if before.string && !level.string {
                        y[1] = 0.0;
                    }
                    if before.booster && !level.booster {
                        y[4] = 0.0;
                    }
                    switches += 1;
                }
            }
            let k = second as usize + 1;
            // Sizes: 1 bar, 1 m, 100 lpm; m s and the speed.
            let sizes = [BAR, 1.0, 100.0 * LPM, BAR, 1.0, 100.0 * LPM, 1.0, 100.0 * LPM, 10.0, 1.0];
            for i in 0..10 {
                worst[i] = worst[i].max((y[i] - run.unknown(names[i], k)).abs() / sizes[i]);
            }
        }
        let shown = worst.map(|off| format!("{off:.0e}"));
        println!("{switches} switches; off by {shown:?}");
        assert_eq!(switches, 2);
        assert!(worst.iter().all(|off| *off < 1e-6), "{worst:?}");
    }
}
