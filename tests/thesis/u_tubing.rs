//! What the thesis says of U-tubing in the booster line (section 3.7) and of its final model
//! (chapter 4): `mud_circulation_u_tubing`, the forms of the effect `booster_u_tubing`, and the
//! riser with its `booster_line`.

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::{Effect, EffectApplication, EffectBlending, apply};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;
use dgd_execute::{Engine, LoadedSystem};
use dgd_runtime::{InputColumn, Inputs, Options, Problem, System, observe, simulate};

use crate::support::{compiled_text, name, root};

const LPM: f64 = 1e-3 / 60.0;
const RHO_G: f64 = 1120.0 * 9.81;
/// Cross-sections of the booster line and of the riser, m².
const A_B: f64 = 0.0103;
const A_R: f64 = std::f64::consts::FRAC_PI_4 * (19.75 * 0.0254) * (19.75 * 0.0254);
/// Friction of the booster line, Pa s/m³, and the time in which its column drains by 1/e, s.
const F_B: f64 = 6e7;
const TAU_LINE: f64 = A_B * F_B / RHO_G;

/// A model of the repository, some choices of its variants, and effects that are applied to it.
fn system(model: &str, variants: &[(&str, &str)], effects: &[&str]) -> LoadedSystem {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let models = root().join("models");
    let source = |path: &str| {
        let path = models.join(path);
        let text = std::fs::read_to_string(&path).expect("a file of the repository");
        SourceText { name: path.display().to_string(), text }
    };
    let mut read = |path: &str| std::fs::read_to_string(path).map_err(|error| error.to_string());
    let compiled =
        load(source(model), &mut read, &mut sources, &mut diagnostics).and_then(|asts| {
            let mut read = Vec::new();
            for effect in effects {
                let id = sources.add(source(&format!("effects/{effect}.dgd")));
                let ast = parse(id, &sources, &mut diagnostics)?;
                read.push(Effect::read(ast, &mut diagnostics)?);
            }
            let applications: Vec<EffectApplication<'_>> = read
                .iter()
                .map(|effect| EffectApplication {
                    effect,
                    arguments: Vec::new(),
                    span: effect.name.span,
                })
                .collect();
            let applied = apply(&asts, &applications, EffectBlending::Applied, &mut diagnostics)?;
            let variants = variants.iter().map(|(v, c)| (name(v), name(c))).collect();
            let options = ModelOptions { variants, ..ModelOptions::default() };
            compile_asts(applied.asts, &options, &SensitivityDirections::None, &mut diagnostics)
        });
    let compiled = compiled.unwrap_or_else(|_| {
        panic!("{}", render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain))
    });
    LoadedSystem::with_engine(compiled.program, Engine::Native)
}

/// Columns over time, in SI.
struct Recording {
    times: Vec<f64>,
    columns: Vec<(String, Vec<f64>)>,
}

impl Recording {
    #[track_caller]
    fn column(&self, name: &str) -> &[f64] {
        let column = self.columns.iter().find(|(column, _)| column == name);
        &column.unwrap_or_else(|| panic!("no column `{name}`")).1
    }

    /// A recording in the repository; pressures are in bar and flows in lpm.
    fn read(file: &str) -> Recording {
        let path = root().join("examples/data").join(file);
        let text = std::fs::read_to_string(path).expect("a file of the repository");
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
        let factor = |unit: &str| match unit {
            "[s]" => 1.0,
            "[%]" => 0.01,
            "[lpm]" => LPM,
            "[bara]" | "[barg]" => 1e5,
            other => panic!("{other}"),
        };
        let mut columns: Vec<(String, Vec<f64>)> = header
            .iter()
            .map(|cell| (cell.split(' ').next().expect("a name").to_owned(), Vec::new()))
            .collect();
        for line in lines {
            for ((cell, head), (_, column)) in line.split(',').zip(&header).zip(&mut columns) {
                let unit = head.split(' ').nth(1).expect("a unit");
                column.push(cell.parse::<f64>().expect("a number") * factor(unit));
            }
        }
        let (_, times) = columns.remove(0);
        Recording { times, columns }
    }

    /// Columns whose values are those of functions at every second up to a last one.
    fn of(last: u32, columns: &[(&str, &dyn Fn(f64) -> f64)]) -> Recording {
        let times: Vec<f64> = (0..=last).map(f64::from).collect();
        let column = |f: &dyn Fn(f64) -> f64| times.iter().map(|t| f(*t)).collect();
        let columns = columns.iter().map(|(name, f)| ((*name).to_owned(), column(f))).collect();
        Recording { times, columns }
    }

    /// Riser level, m, that the measured riser pressure says.
    fn level(&self) -> Vec<f64> {
        let p_r = self.column("p_r");
        p_r.iter().map(|p_r| 305.0 - (p_r - 101_325.0) / RHO_G).collect()
    }

    /// ∫ of a column between two times, by the trapezoidal rule.
    fn integral(&self, name: &str, from: f64, until: f64) -> f64 {
        let samples: Vec<(f64, f64)> = self.between(name, from, until);
        samples.windows(2).map(|w| (w[1].0 - w[0].0) * f64::midpoint(w[0].1, w[1].1)).sum()
    }

    fn between(&self, name: &str, from: f64, until: f64) -> Vec<(f64, f64)> {
        let samples = self.times.iter().copied().zip(self.column(name).iter().copied());
        samples.filter(|(t, _)| (from..=until).contains(t)).collect()
    }

    /// Runs a system on the recording's inputs; parameters and start values that are not declared
    /// ones are given by name, in SI. What is computed has the names of unknowns and outputs.
    fn run(&self, system: &LoadedSystem, settings: &[(&str, f64)], options: &Options) -> Recording {
        let signature = system.signature();
        let columns: Vec<InputColumn<'_>> = signature
            .inputs
            .iter()
            .map(|input| InputColumn {
                name: &input.name,
                interpolation: input.interpolation,
                values: self.column(&input.name),
            })
            .collect();
        let inputs = Inputs::recorded(&self.times, &columns).expect("inputs at all times");
        let mut p: Vec<f64> = signature.parameters.iter().map(|p| p.value).collect();
        let mut start = Vec::new();
        let unknowns: Vec<String> =
            signature.unknowns.iter().map(|x| x.name.into_owned()).collect();
        for (name, value) in settings {
            if let Some(at) = signature.parameters.iter().position(|p| p.name == *name) {
                p[at] = *value;
            } else if let Some(at) = unknowns.iter().position(|x| x == name) {
                start.push((at, *value));
            } else {
                panic!("neither parameter nor unknown: `{name}`");
            }
        }
        let problem = Problem { system, p: &p, inputs: &inputs, start: &start };
        let solution =
            simulate(&problem, &self.times, options).unwrap_or_else(|failure| panic!("{failure}"));
        let observed = observe(&problem, &solution);
        let n = self.times.len();
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        for (i, name) in unknowns.into_iter().enumerate() {
            columns.push((name, (0..n).map(|k| solution.y(k)[i]).collect()));
        }
        for (i, output) in signature.outputs.iter().enumerate() {
            let values = (0..n).map(|k| observed.w(k)[i]).collect();
            columns.push((format!("output {}", output.name), values));
        }
        Recording { times: self.times.clone(), columns }
    }
}

fn tolerance(tolerance: f64) -> Options {
    Options { rtol: tolerance, atol: tolerance, ..Options::default() }
}

/// Largest absolute value.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, x| largest.max(x.abs()))
}

fn differences(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

const EFFECTS: [&str; 4] = [
    "booster_u_tubing/delay_and_integrator",
    "pump_speed_exponent",
    "friction_higher_order",
    "flow_meter_gain",
];

/// Parameters with which `mud_circulation` is the plant of the thesis' final model.
///
/// That has flows as the meter reads them. True flows are theta_1 times as large: friction and losses
/// of power n are divided by theta_1^n, and inertia by theta_1.
fn circulation(effects: &[&str]) -> Vec<(&'static str, f64)> {
    let theta_1: f64 = 0.951;
    let mut all = vec![
        ("M_ssp", 1.1e8 / theta_1),
        ("c0", 400.0),
        ("c2", 9.0e3 / theta_1.powi(2)),
        ("F1", 1e6 / theta_1),
        ("F2", 1.5e8 / theta_1.powi(2)),
    ];
    for effect in effects {
        match *effect {
            "pump_speed_exponent" => all.push(("speed_exponent", 1.8)),
            "friction_higher_order" => {
                all.extend([("F3", -2e8 / theta_1.powi(3)), ("F4", 1.5e10 / theta_1.powi(4))]);
            }
            "flow_meter_gain" => all.push(("flow_gain", 1.0 / theta_1)),
            _ => {}
        }
    }
    all
}

#[test]
fn the_final_model_is_the_circulation_with_its_effects_applied() {
    let recording = Recording::read("case_2.csv");
    for (flow, inertia) in
        [("dynamic", "constant"), ("static", "constant"), ("dynamic", "by_level")]
    {
        let variants = [("flow", flow), ("inertia", inertia)];
        let whole = system("mud_circulation_u_tubing.dgd", &variants, &[]);
        let settings = [("h_r", 200.0)];
        let whole = recording.run(&whole, &settings, &tolerance(1e-9));
        let with = |effects: &[&str]| {
            let system = system("mud_circulation.dgd", &variants, effects);
            let settings = [circulation(effects), vec![("h_r", 200.0)]].concat();
            recording.run(&system, &settings, &tolerance(1e-9))
        };
        let all = with(&EFFECTS);
        for (output, size) in [("output q_ssp", 0.05), ("output p_r", 20e5), ("output p_out", 40e5)]
        {
            let apart = largest(&differences(all.column(output), whole.column(output)));
            // Both are within the tolerance of the solution; over some hundred steps and events that
            // are not forgotten at once it adds up to less than a hundred times as much.
            assert!(apart < 1e-7 * size, "{flow}, {inertia}, {output}: {apart:e}");
        }
        // Each of them is needed: without it the level is off by half a metre at least, or the reading
        // of the flow by a twentieth of 2000 lpm.
        for left_out in EFFECTS {
            let others: Vec<&str> = EFFECTS.into_iter().filter(|one| *one != left_out).collect();
            let run = with(&others);
            let apart = |name: &str| largest(&differences(run.column(name), whole.column(name)));
            let (level, flow) = (apart("h_r"), apart("output q_ssp"));
            assert!(level > 0.5 || flow > 100.0 * LPM, "{left_out}: {level}, {flow}");
        }
    }
}

/// The level's error, m, and the flow's, m³/s, of a simulation from the recording's first level.
fn errors(
    recording: &Recording,
    model: &str,
    effects: &[&str],
    more: &[(&str, f64)],
) -> [Vec<f64>; 2] {
    let measured = recording.level();
    // The mean of the first half minute, in which nothing happens: 0.01 bar of noise are 9 cm.
    let h_0 = measured[..6].iter().sum::<f64>() / 6.0;
    let settings = [more, &[("h_r", h_0)]].concat();
    let run = recording.run(&system(model, &[], effects), &settings, &tolerance(1e-6));
    [
        differences(run.column("h_r"), &measured),
        differences(run.column("output q_ssp"), recording.column("q_ssp")),
    ]
}

#[test]
fn case_1_normal_circulation_is_reproduced() {
    let recording = Recording::read("case_1.csv");
    let [level, flow] = errors(&recording, "mud_circulation_u_tubing.dgd", &[], &[]);
    let levels = recording.level();
    let swing = levels.iter().fold(0.0f64, |l, h| l.max(h - levels[0])); // 10 m and more
    assert!(swing > 8.0, "the level moves by {swing} m");
    // Fig 4.1: ±0.1 % of a scale on which 0.5 bar are less than 0.4 %, so about 1.1 m; the reading's
    // own noise and rounding is 0.1 m, of which 700 samples show four times as much.
    assert!(largest(&level) < 0.5, "{} m", largest(&level));
    // Fig 4.1: ±5 %.
    let scale = largest(recording.column("q_ssp"));
    assert!(largest(&flow) < 0.05 * scale, "{} lpm", largest(&flow) / LPM);
}

#[test]
fn case_2_needs_u_tubing_and_any_of_the_forms_that_fit() {
    let recording = Recording::read("case_2.csv");
    let others = &EFFECTS[1..];
    let with = |form: Option<&str>, more: &[(&str, f64)]| {
        let form = form.map(|form| format!("booster_u_tubing/{form}"));
        let effects: Vec<&str> = others.iter().copied().chain(form.as_deref()).collect();
        let settings = [circulation(&effects), more.to_vec()].concat();
        errors(&recording, "mud_circulation.dgd", &effects, &settings)
    };
    let [level, flow] = errors(&recording, "mud_circulation_u_tubing.dgd", &[], &[]);
    // Chapter 4: the level's error is less than 0.5 bar.
    let final_model = largest(&level);
    assert!(RHO_G * final_model < 0.5e5, "{final_model} m");
    assert!(largest(&flow) < 0.1 * largest(recording.column("q_ssp")), "{}", largest(&flow) / LPM);
    // Fig B.1: 2 % without U-tubing, against 0.4 %.
    let [without, _] = with(None, &[]);
    assert!(largest(&without) > 4.0 * final_model, "{} and {final_model} m", largest(&without));
    // Fig 3.16: the column with its weights fits.
    let [weighted, _] = with(Some("weighted_column"), &[]);
    assert!(largest(&weighted) < 1.0, "{} m", largest(&weighted));
    // Fig 3.15: the column alone is not far off when the pump stops, and far off when it is started
    // again, by much of the line's volume: 200 m of it are 10 m of riser.
    let [column, _] = with(Some("column_with_momentum"), &[]);
    let within = |from: f64, until: f64| -> f64 {
        let samples = recording.times.iter().zip(&column);
        samples
            .filter(|(t, _)| (from..until).contains(*t))
            .fold(0.0, |largest, (_, e)| largest.max(e.abs()))
    };
    let (ramp_down, ramp_up) = (within(480.0, 900.0), within(900.0, 1200.0));
    assert!(ramp_down < 1.5, "{ramp_down} m until the pump is started again");
    assert!(ramp_up > 4.0 * ramp_down, "{ramp_up} m behind that, {ramp_down} m before");
}

/// A value on straight lines between points.
fn lines(points: &[(f64, f64)], t: f64) -> f64 {
    let after = points.partition_point(|(x, _)| *x <= t);
    if after == 0 || after == points.len() {
        return points[after.saturating_sub(1)].1;
    }
    let ((a, x), (b, y)) = (points[after - 1], points[after]);
    x + (y - x) * (t - a) / (b - a)
}

/// Flow of the booster pump, m³/s, about which section 3.7 speaks.
const Q: f64 = 2200.0 * LPM;

/// The booster pump is stopped within 20 s at 60 s, and started again within 20 s at 400 s.
fn stop_and_start(t: f64) -> f64 {
    lines(&[(60.0, Q), (80.0, 0.0), (400.0, 0.0), (420.0, Q)], t)
}

/// The circulation with the booster pump stopped and started, and the subsea pump following.
fn stopped_and_started() -> Recording {
    let speed =
        |t: f64| lines(&[(100.0, 0.7663), (130.0, 0.71), (415.0, 0.71), (445.0, 0.7663)], t);
    let inputs: [(&str, &dyn Fn(f64) -> f64); 3] =
        [("w_ssp", &speed), ("q_boost", &stop_and_start), ("q_tf", &|_| 200.0 * LPM)];
    Recording::of(800, &inputs)
}

fn with_form(form: &str, more: &[(&str, f64)]) -> Recording {
    let form = format!("booster_u_tubing/{form}");
    let effects: &[&str] = if form.ends_with('/') { &[] } else { &[&form] };
    // A pump that holds 200 m, where 3.11 with the thesis' numbers is just full: F_b q = rho g h_r.
    let settings = [&[("c0", 400.0), ("h_r", 199.0)], more].concat();
    stopped_and_started().run(
        &system("mud_circulation.dgd", &[], effects),
        &settings,
        &tolerance(1e-7),
    )
}

#[test]
fn delay_lag_and_integrator_have_the_volumes_of_their_formulas() {
    for (tau_d, tau_b, theta_i) in
        [(30.0, 10.0, 0.03), (30.0, 10.0, 0.05), (30.0, 10.0, 0.07), (0.0, 40.0, 0.05)]
    {
        let settings = [("tau_d", tau_d), ("tau_b", tau_b), ("theta_i", theta_i)];
        let run = with_form("delay_and_integrator", &settings);
        // 3.13 lets out q (tau_d + tau_b) more than what is pumped, whatever the ramp: 1.47 m³, a
        // column of 142 m of "roughly 160 m". The trapezoidal rule on a second is off by 1e-4 of it
        // at the kinks, and 20 lpm at the ramp's beginning are needed to see it.
        let pumped = Q * 10.0;
        let drained = run.integral("q_bo", 60.0, 400.0) - pumped;
        let expected = Q * (tau_d + tau_b);
        assert!((drained / expected - 1.0).abs() < 2e-3, "{drained} m³, not {expected}");

        // 3.14 with a ramp of 20 s: theta_i q (t − 10 s) = q. Beginning from 20 lpm it is 0.1 s late.
        let crossing = 410.0 + 1.0 / theta_i;
        let q_bo = run.between("q_bo", 400.0, 500.0);
        let full = q_bo.iter().find(|(_, q)| *q >= Q * (1.0 - 1e-9)).expect("it comes back").0;
        assert!((crossing..crossing + 1.5).contains(&full), "{full} s, not {crossing} s");
    }
}

#[test]
fn figures_3_14_to_3_19_have_their_shapes() {
    // What the thesis measured is confidential. Of its models 3.12 fits ramp-down and ramp-up; it is
    // taken for the measured level here, and the others are compared with it.
    let measured = with_form("weighted_column", &[]);
    let error = |run: &Recording, from: f64, until: f64| -> Vec<f64> {
        let pair = |r: &Recording| -> Vec<f64> {
            r.between("h_r", from, until).into_iter().map(|(_, h)| h).collect()
        };
        differences(&pair(run), &pair(&measured))
    };
    let simple = |more: &[(&str, f64)]| with_form("delay_and_integrator", more);

    // Fig 3.14: without U-tubing the level begins to rise at once, by 6 m within a minute.
    let without = error(&with_form("", &[]), 60.0, 400.0);
    assert!(largest(&without) > 5.0, "{} m", largest(&without));
    // Fig 3.15: 3.11 is not far off on ramp-down, and far off on ramp-up.
    let column = with_form("column_with_momentum", &[]);
    let (down, up) =
        (largest(&error(&column, 60.0, 400.0)), largest(&error(&column, 400.0, 600.0)));
    assert!(down < 0.2 * largest(&without) && up > 5.0 * down, "{down} m, {up} m");
    // Its level comes near the riser's, and that of 3.12 does not: θ_hb h_b = h_r. What is left of
    // 200 m after 320 s is e^(-320/56.2) of it, and e^(-320/37.5).
    let last = |run: &Recording, name: &str| run.between(name, 400.0, 400.0)[0].1;
    let apart = last(&column, "h_r") - last(&column, "h_b");
    assert!((apart / 200.0 - (-310.0 / TAU_LINE).exp()).abs() < 3e-3, "{apart} m");
    let apart = last(&measured, "h_r") - 1.5 * last(&measured, "h_b");
    assert!(apart.abs() < 0.5, "{apart} m");
    // Fig 3.16: on ramp-up more comes out of the line than 3.11 lets out; it is full within 25 s.
    let refilled = measured.between("h_b", 405.0, 800.0).into_iter().find(|(_, h_b)| *h_b <= 0.0);
    let refilled = refilled.expect("it is full again").0;
    assert!(refilled < 425.0, "{refilled} s");

    // Fig 3.17: with a lag of 40 s alone the level rises before the measured one does; with 30 s of it
    // as a delay it does not.
    let early = |run: &Recording| error(run, 65.0, 85.0).into_iter().sum::<f64>() / 21.0;
    let (lag, delay) = (early(&simple(&[("tau_d", 0.0), ("tau_b", 40.0)])), early(&simple(&[])));
    assert!(lag > 0.1 && delay < 0.0 && delay > -lag, "{lag} m, {delay} m");
    // Fig 3.18: the level after ramp-up, the higher, the slower the integrator. What is missing until
    // it is at the set point is q/(2 theta_i).
    let levels = [0.03, 0.05, 0.07]
        .map(|theta_i| simple(&[("theta_i", theta_i)]).between("h_r", 450.0, 450.0)[0].1);
    for ((slow, fast), (a, b)) in
        [(levels[0], levels[1]), (levels[1], levels[2])].iter().zip([(0.03, 0.05), (0.05, 0.07)])
    {
        let expected = Q / (2.0 * A_R) * (1.0 / a - 1.0 / b);
        // The return line has let a part of it go by then, less than a tenth.
        let difference = slow - fast;
        assert!(
            (0.85 * expected..1.01 * expected).contains(&difference),
            "{difference}, {expected}"
        );
    }
    // Fig 3.19: both together are within a fifth of what U-tubing does to the level.
    let both = largest(&error(&simple(&[]), 60.0, 800.0));
    assert!(both < 0.2 * largest(&without), "{both} m");
}

/// The booster line below a riser so wide, of 5·10⁸ m², that its level does not move. The pump is
/// stopped within 20 s at 100 s, and started again within 20 s at 1100 s.
fn line_alone(h_r: f64, top: &str, more: &[(&str, f64)]) -> Recording {
    let pumped = |t: f64| lines(&[(100.0, Q), (120.0, 0.0), (1100.0, 0.0), (1120.0, Q)], t);
    let inputs: [(&str, &dyn Fn(f64) -> f64); 3] =
        [("q_boost", &pumped), ("q_ssp", &|_| 0.0), ("q_tf", &|_| 0.0)];
    let path = root().join("models/booster_line.dgd");
    let text = std::fs::read_to_string(&path).expect("a file of the repository");
    let chosen = (&[("top", top)][..], &["d_r=1e6"][..]);
    let compiled = compiled_text(&path, text, chosen, &SensitivityDirections::None);
    let system = LoadedSystem::with_engine(compiled.program, Engine::Native);
    let settings = [more, &[("h_r", h_r)]].concat();
    Recording::of(1600, &inputs).run(&system, &settings, &tolerance(1e-8))
}

#[test]
fn the_booster_line_drops_by_160_m_and_misses_45_s_of_its_pump() {
    let at = |run: &Recording, name: &str, t: f64| run.between(name, t, t)[0].1;
    let vapour = (101_325.0 - 2340.0) / RHO_G;
    // 3.11: equal columns. Sealed, the vapour holds 9 m of the column up. 3.12: its weight is 1.5.
    for (h_r, top, weights) in [
        (160.0, "open", [1.0, 1.0]),
        (160.0 + vapour, "sealed", [1.0, 1.0]),
        (240.0, "open", [1.5, 3.6]),
    ] {
        let settings = [("line.theta_x", weights[0]), ("line.theta_q", weights[1])];
        let run = line_alone(h_r, top, &settings);
        // After 980 s e^(-980/56) of it is left, 4e-6 m.
        let drop = at(&run, "line.x", 1100.0);
        assert!((drop - 160.0).abs() < 1e-4, "{drop} m at a level of {h_r} m, {top}");
        // The riser lacks what the line takes until it is full: 160 m · 0.0103 m² over
        // 2200 lpm, 44.9 s, "roughly 45 seconds"; and 0.02 s for the pressure. When the line is full
        // the flow rises from 1750 to 2200 lpm within a second, on which the trapezoidal rule is off
        // by up to half of that.
        if weights[1] == 1.0 {
            // 490 s of full flow are pumped within the 500 s from the start of the ramp.
            let missing = 490.0 - run.integral("line.q", 1100.0, 1600.0) / Q;
            assert!((missing - 160.0 * A_B / Q).abs() < 0.1, "{missing} s");
        }
    }
}

#[test]
fn a_full_line_is_under_the_pressure_of_its_pump() {
    let run = line_alone(160.0, "open", &[]);
    // p_b = F_b q − rho g h_r at rest, 4.4 bar.
    let pressure = run.between("line.p", 90.0, 90.0)[0].1;
    let expected = F_B * Q - RHO_G * 160.0;
    assert!((pressure - expected).abs() < 1.0, "{pressure} Pa, not {expected} Pa");

    // With the weight of 3.12 it pumps θ q at no pressure and q from 1 bar on: the same balance with
    // F_b q (1 + (θ − 1)(1 − p_b/bar)) has its p_b at 0.993 bar, where without it that is at 0.575 bar.
    let (h_r, theta) = (195.0, 3.6);
    let run = line_alone(h_r, "open", &[("line.theta_q", theta)]);
    let pressure = run.between("line.p", 90.0, 90.0)[0].1;
    let expected = (F_B * Q * theta - RHO_G * h_r) / (1.0 + (theta - 1.0) * F_B * Q / 1e5);
    assert!((pressure - expected).abs() < 1.0, "{pressure} Pa, not {expected} Pa");
}

#[test]
fn the_booster_line_drains_and_fills_as_fast_as_its_friction_lets_it() {
    let run = line_alone(160.0, "open", &[]);
    // A_b M x″ + A_b F_b x′ + rho g x = 0 for small x = h_r − h_b, M = rho/A_b (l_bo − h_r).
    let m = 1120.0 / A_B * (340.0 - 160.0);
    let (b, c) = (F_B / m, RHO_G / (A_B * m));
    let rate = b / 2.0 - (b * b / 4.0 - c).sqrt();
    let x = |t: f64| 160.0 - run.between("line.x", t, t)[0].1;
    let found = (x(400.0) / x(500.0)).ln() / 100.0;
    // x is 1 m and less of 180 m, by which M changes, and M is a hundredth of the matter.
    assert!((found / rate - 1.0).abs() < 1e-3, "{found}, not {rate}");
    // 3.11 fills the line slowly, Fig 3.15: x = F_b q/(rho g) (1 − e^(-t/tau)), 90.5 s for 160 m
    // after a ramp that counts 10 s. Its inertia, M/F_b = 0.5 s, is left out.
    let full = F_B * Q / RHO_G;
    let expected = 1110.0 + TAU_LINE * (full / (full - 160.0)).ln();
    let filled = run.between("line.x", 1105.0, 1600.0).into_iter().find(|(_, x)| *x <= 0.0);
    let filled = filled.expect("it is full again").0;
    assert!((filled - expected).abs() < 2.0, "{filled} s, not {expected} s");
}

#[test]
fn riser_and_booster_line_lose_no_mud() {
    let recording = Recording::read("case_2.csv");
    let system = system("booster_line.dgd", &[], &[]);
    let run = recording.run(&system, &[], &tolerance(1e-10));
    // Mud in the riser, in the line, and what the line's pressure adds to it.
    let beta = 1120.0 * 1484.0 * 1484.0;
    let n = recording.times.len();
    let stored = |k: usize| {
        let at = |name: &str| run.column(name)[k];
        -A_R * at("h_r") - A_B * at("line.x") + 340.0 * A_B / beta * at("line.p")
    };
    // Linear between samples are q_boost and q_ssp, held is q_tf.
    let end = recording.times[n - 1];
    let linear =
        recording.integral("q_boost", 0.0, end) - 0.951 * recording.integral("q_ssp", 0.0, end);
    let held: f64 = recording.column("q_tf")[..n - 1].iter().map(|q| 5.0 * q).sum();
    let (change, through) = (stored(n - 1) - stored(0), recording.integral("q_boost", 0.0, end));
    // A level of 200 m times the tolerance is 4e-9 m³, of some 200 m³ that went through; it adds up
    // over a few thousand steps.
    assert!((change - linear - held).abs() < 1e-6, "{:e} m³ of {through}", change - linear - held);
    assert!(through > 150.0, "{through}");
    // The level in the line has been far down.
    assert!(largest(run.column("line.x")) > 180.0);
}
