//! The recordings in `examples/data/field/`, which stand in for the thesis' field data: they are those of the recipe,
//! dgd reads them, and the thesis' own analyses find in them what was put there.

use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::{self, EffectApplication, EffectBlending};
use dgd_compiler::model::{DeclarationHeader, Model, ModelOptions, resolve};
use dgd_compiler::pipeline::load;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_data::write::save;
use dgd_data::{DataTable, DiskFiles, read, read_from, select};
use dgd_work::load_folder;

use crate::drilling_rig::plant::{A_B, A_R, G, H_IN, H_OUT, H_PR, L_B, LPM, RHO};
use crate::field_rig::Rig;
use crate::field_rig::files::truth_json;
use crate::field_rig::plant::{Controls, Pipe, Plant, State};
use crate::field_rig::schedule::schedules;
use crate::support;

fn data() -> PathBuf {
    support::root().join("examples/data/field")
}

fn table(name: &str) -> DataTable {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let file = data().join(format!("{name}.csv.gz"));
    let table = read(&file, &mut sources, &mut diagnostics);
    assert!(diagnostics.sorted().is_empty(), "{}", shown(&diagnostics, &sources));
    table.expect("nothing was reported")
}

fn shown(diagnostics: &Diagnostics, sources: &SourceMap) -> String {
    render::render(&diagnostics.sorted(), sources, render::RenderStyle::Plain)
}

/// A column in the file's own unit.
fn column(table: &DataTable, name: &str) -> Vec<f64> {
    table.column(name).expect("a column").values.clone()
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for value in values {
        sum += value;
        n += 1.0;
    }
    sum / n
}

fn deviation(values: &[f64]) -> f64 {
    let middle = mean(values.iter().copied());
    mean(values.iter().map(|v| (v - middle).powi(2))).sqrt()
}

/// Parameters of y = Σ θ_j φ_j by the normal equations, and 1 − SS_res/SS_tot.
fn least_squares(phi: &[Vec<f64>], y: &[f64]) -> (Vec<f64>, f64) {
    let n = phi.len();
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    // Columns of length one, so that the pivots compare.
    let size: Vec<f64> = phi.iter().map(|c| dot(c, c).sqrt()).collect();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row: Vec<f64> =
                (0..n).map(|j| dot(&phi[i], &phi[j]) / size[i] / size[j]).collect();
            row.push(dot(&phi[i], y) / size[i]);
            row
        })
        .collect();
    // Gauss and Jordan; the matrix is positive definite and needs no exchange of rows.
    for i in 0..n {
        let pivot: Vec<f64> = rows[i].iter().map(|x| x / rows[i][i]).collect();
        for row in &mut rows {
            let factor = row[i];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
        rows[i] = pivot;
    }
    let theta: Vec<f64> = (0..n).map(|i| rows[i][n] / size[i]).collect();
    let middle = mean(y.iter().copied());
    let total: f64 = y.iter().map(|y| (y - middle).powi(2)).sum();
    let left: f64 = (0..y.len())
        .map(|k| (y[k] - (0..n).map(|j| theta[j] * phi[j][k]).sum::<f64>()).powi(2))
        .sum();
    (theta, 1.0 - left / total)
}

/// Riser level by inlet sensor A, m, from its reading in barg.
fn level(p_in: f64) -> f64 {
    H_IN - p_in * 1e5 / (RHO * G)
}

#[test]
fn the_files_are_those_of_the_recipe() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("field_data");
    fs::create_dir_all(&folder).expect("a folder");
    for schedule in schedules() {
        let recording = schedule.rig().record(&schedule);
        for (ending, text) in [("csv.gz", recording.csv()), ("truth.csv.gz", recording.truth_csv())]
        {
            let file = format!("{}.{ending}", schedule.name);
            let path = folder.join(&file);
            save(&path, |out| out.write_all(text.as_bytes())).expect("it is written");
            let [made, shipped] = [path, data().join(&file)].map(|p| fs::read(p).expect("a file"));
            assert!(made == shipped, "{file}: run `cargo run --release --example field_data`");
        }
    }
    let shipped = fs::read_to_string(data().join("truth.json")).expect("the truth");
    assert_eq!(shipped, truth_json(&schedules()));
}

#[test]
fn the_files_are_small_and_the_recordings_as_long_as_asked() {
    let files = fs::read_dir(data()).expect("a folder");
    let bytes: u64 =
        files.map(|file| file.expect("a file").metadata().expect("its size").len()).sum();
    assert!(bytes < 5_000_000, "{bytes}");
    for (name, seconds) in [
        ("no_flow", 800),
        ("normal_circulation", 3500),
        ("booster_ramps", 6000),
        ("booster_restarts", 5900),
        ("pump_tests", 0),
    ] {
        for name in [name.to_owned(), format!("{name}.truth")] {
            let table = table(&name);
            let times = table.time.as_deref().expect("a recording");
            assert!(times.len() > seconds, "{name}: {}", times.len());
            assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 1.0), "{name}: 1 Hz");
        }
    }
}

/// The circulation model with the field's instruments.
fn instrumented() -> Model {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let text = fs::read_to_string(support::root().join("models/mud_circulation.dgd"));
    let main = SourceText { name: "mud_circulation.dgd".into(), text: text.expect("the model") };
    let mut read = |_: &str| Err("this model imports nothing".to_owned());
    let model = load(main, &mut read, &mut sources, &mut diagnostics).and_then(|asts| {
        let effects = load_folder(&DiskFiles, &data(), &mut sources, &mut diagnostics)?;
        let [effect] = effects.as_slice() else { panic!("one effect is beside the recordings") };
        let application =
            EffectApplication { effect, arguments: Vec::new(), span: effect.name.span };
        let applied =
            effects::apply(&asts, &[application], EffectBlending::Applied, &mut diagnostics)?;
        resolve(&applied.asts, &ModelOptions::default(), &mut diagnostics)
    });
    model.unwrap_or_else(|_| panic!("{}", shown(&diagnostics, &sources)))
}

fn declared(d: &DeclarationHeader) -> select::DeclaredColumn<'_> {
    select::DeclaredColumn { name: &d.name, unit: &d.unit, place: None }
}

#[test]
fn the_circulation_model_with_the_fields_instruments_knows_every_column() {
    let model = instrumented();
    let inputs: Vec<_> = model.inputs.iter().map(|input| declared(&input.declared)).collect();
    let outputs: Vec<_> = model.outputs.iter().map(|output| declared(&output.declared)).collect();
    let known: Vec<&str> = inputs.iter().chain(&outputs).map(|d| d.name).collect();
    for schedule in schedules() {
        let table = table(schedule.name);
        assert!(select::unknown(&table, &known).is_empty(), "{}", schedule.name);

        let mut diagnostics = Diagnostics::default();
        let read = select::inputs(&table, &inputs, &mut diagnostics).expect("every input");
        let measured = select::measured(&table, &outputs, &mut diagnostics).expect("units agree");
        assert_eq!((table.columns.len(), read.len()), (9, 3));
        // All but the ideal sensors p_in and p_out.
        let measured: Vec<_> =
            outputs.iter().zip(measured).filter_map(|(o, v)| Some((o.name, v?))).collect();
        assert_eq!(
            measured.iter().map(|(name, _)| *name).collect::<Vec<_>>(),
            ["p_r", "q_ssp", "p_in_A", "p_in_B", "p_out_A", "p_out_B"]
        );
        // SI inside: 17 bara stay 17 bar, 2500 lpm are 0.04 m³/s.
        let bar = column(&table, "p_r")[0] * 1e5;
        assert!((measured[0].1[0] - bar).abs() < 1e-6 * bar);
        let flow = column(&table, "q_ssp")[9] * LPM;
        assert!((measured[1].1[9] - flow).abs() < 1e-12);
    }
}

#[test]
fn a_recording_that_breaks_off_is_refused_by_name() {
    let bytes = fs::read(data().join("booster_ramps.csv.gz")).expect("a file");
    for kept in [bytes.len() - 1, bytes.len() / 2, 12] {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let cut = read_from("half.csv.gz", &bytes[..kept], &mut sources, &mut diagnostics);
        assert!(cut.is_err(), "{kept} bytes");
        let text = shown(&diagnostics, &sources);
        assert!(text.contains("E601") && text.contains("half.csv.gz"), "{text}");
    }
}

#[test]
fn at_no_flow_the_offsets_are_those_that_were_planted() {
    // Section 3.3.1. A reading errs by 0.008 bar and by its count of 0.01 bar, a mean of 801 by
    // √(0.008² + 0.01²/12)/√801 = 3e-4 bar, and a difference of two by √2 of that; five times.
    let close =
        5.0 * 2f64.sqrt() * (0.008f64.powi(2) + 0.01f64.powi(2) / 12.0).sqrt() / 801f64.sqrt();
    let table = table("no_flow");
    let gauge = |name: &str| mean(column(&table, name));
    let riser = gauge("p_r") - 1.01325;
    let deeper = RHO * G * (H_IN - H_PR) / 1e5;
    assert!((deeper - 0.22).abs() < 0.001);
    assert!((gauge("p_in_A") - riser - deeper).abs() < close);
    assert!((gauge("p_in_B") - riser - deeper - 0.5).abs() < close);

    // The return line is full: its weight is the outlet's pressure, which A and B differ from while
    // their mean does not.
    let weight = RHO * G * H_OUT / 1e5;
    let [a, b] = ["p_out_A", "p_out_B"].map(|name| gauge(name) - weight);
    assert!((a - 0.06).abs() < close && (b + 0.06).abs() < close, "{a} {b}");
    assert!(f64::midpoint(a, b).abs() < close);
    assert!(column(&table, "q_ssp").iter().all(|&q| q == 0.0));
}

#[test]
fn every_reading_is_the_truth_with_its_error() {
    for schedule in schedules() {
        let (read, truth) = (table(schedule.name), table(&format!("{}.truth", schedule.name)));
        let n = schedule.seconds as f64 + 1.0;
        let errors = |reading: &str, of: &str| -> Vec<f64> {
            column(&read, reading).iter().zip(column(&truth, of)).map(|(a, b)| a - b).collect()
        };
        let pressures = [
            ("p_r", "p_r", 0.0),
            ("p_in_A", "p_in", 0.0),
            ("p_in_B", "p_in", 0.5),
            ("p_out_A", "p_out", 0.06),
            ("p_out_B", "p_out", -0.06),
        ];
        // Noise, the count of 0.01 bar, and the truth's own of 0.001 bar; of a mean and of a
        // standard deviation five standard errors.
        let sigma = (0.008f64.powi(2) + (0.01f64.powi(2) + 0.001f64.powi(2)) / 12.0).sqrt();
        for (reading, of, offset) in pressures {
            let errors = errors(reading, of);
            let (off, width) = (mean(errors.iter().copied()) - offset, deviation(&errors));
            assert!(off.abs() < 5.0 * sigma / n.sqrt(), "{reading}: {off}");
            assert!((width / sigma - 1.0).abs() < 5.0 / (2.0 * n).sqrt(), "{reading}: {width}");
        }

        if schedule.name == "no_flow" {
            continue;
        }
        // The return flow meter's first-order lag of 2 s, followed here by the trapezoidal rule, and
        // its gain leave an error of 9 lpm white, 9 lpm coloured and a count of 1 lpm.
        let (metered, flow) = (column(&read, "q_ssp"), column(&truth, "q_ssp"));
        let mut lagged = flow[0];
        let mut errors = Vec::new();
        for k in 0..flow.len() {
            if k > 0 {
                let (tau, middle) = (2.0, flow[k - 1].midpoint(flow[k]));
                lagged = middle + (lagged - middle) * (-1.0f64 / tau).exp();
            }
            errors.push(metered[k] - lagged / 0.951);
        }
        // e⁺ = φ e has e^(−1/4) = 0.78 in common with the next: a mean is as good as that of n/8
        // samples, and of the variance half is correlated.
        let (off, width) = (mean(errors.iter().copied()), deviation(&errors));
        let sigma = (2.0 * 81.0 + 1.0 / 12.0f64).sqrt();
        assert!(off.abs() < 5.0 * sigma / (n / 8.0).sqrt(), "{off}");
        assert!((width / sigma - 1.0).abs() < 5.0 * (4.0 / (2.0 * n)).sqrt(), "{width}");
        let next = errors.windows(2).map(|e| (e[0] - off) * (e[1] - off)).sum::<f64>()
            / (n * width * width);
        assert!((next - 81.0 / sigma.powi(2) * (-0.25f64).exp()).abs() < 0.06, "{next}");
    }
}

#[test]
fn the_isolated_level_gives_the_correction_of_the_return_flow() {
    // (3.9) summed up: A_r Δh_r = θ₁ ∫q_ssp dt − ∫(q_boost + q_tf) dt.
    let table = table("normal_circulation");
    let [boost, fill, metered, inlet] =
        ["q_boost", "q_tf", "q_ssp", "p_in_A"].map(|name| column(&table, name));
    let volume = |q: &[f64]| -> f64 { q.windows(2).map(|q| q[0].midpoint(q[1]) * LPM).sum() };
    let (first, last) = (level(inlet[0]), level(inlet[inlet.len() - 1]));
    let theta = (A_R * (last - first) + volume(&boost) + volume(&fill)) / volume(&metered);
    // Of 158 m³ metered: two readings of the level err by √2 · 0.077 m · A_r = 0.022 m³, the meter's
    // mean by 12.7 lpm/√(3600/8) = 0.60 lpm, or 0.036 m³. Together 2.7e-4 of it; five times.
    assert!((theta - 0.951).abs() < 1.4e-3, "{theta}");

    // Without it the level runs away: 0.049 of 158 m³ are 39 m.
    let drift = (volume(&metered) - volume(&boost) - volume(&fill)) / A_R - (last - first);
    assert!((35.0..45.0).contains(&drift), "{drift}");
}

#[test]
fn the_pump_has_no_fit_with_the_square_of_its_speed() {
    // Section 3.5, from readings alone: the head ΔP/(ρ g), with B of the inlet left out and A and B
    // of the outlet averaged, and the flow corrected.
    let table = table("pump_tests");
    let [inlet, a, b, flow, speed] =
        ["p_in_A", "p_out_A", "p_out_B", "q_ssp", "w_ssp"].map(|name| column(&table, name));
    let n = flow.len();
    let head: Vec<f64> =
        (0..n).map(|k| (a[k].midpoint(b[k]) - inlet[k]) * 1e5 / (RHO * G)).collect();
    let q: Vec<f64> = flow.iter().map(|q| 0.951 * q * LPM).collect();
    let w = |k: f64| -> Vec<f64> { speed.iter().map(|w| (w / 100.0).powf(k)).collect() };
    let minus_square: Vec<f64> = q.iter().map(|q| -q * q).collect();

    // (2.27): the best c1 is negative, and without it low speeds do not fit.
    let minus_cross = w(1.0).iter().zip(&q).map(|(w, q)| -w * q).collect();
    let (theta, _) = least_squares(&[w(2.0), minus_cross, minus_square.clone()], &head);
    assert!(theta[1] < -100.0, "{theta:?}");
    let fit = |k: f64| least_squares(&[w(k), minus_square.clone()], &head);
    let (_, square) = fit(2.0);
    assert!(square < 0.995, "{square}");

    // Section 3.5.1: of all exponents that of the truth is best, and then the numbers are those of
    // the truth. The head errs by 0.1 m; what is left of 1 % is the lag of the flow meter.
    let best = (150..300)
        .map(|k| f64::from(k) / 100.0)
        .max_by(|&a, &b| fit(a).1.total_cmp(&fit(b).1))
        .expect("exponents");
    let (theta, quality) = fit(best);
    assert!((best - 2.2).abs() < 0.011, "{best}");
    assert!((theta[0] / 295.0 - 1.0).abs() < 0.01, "{theta:?}");
    assert!((theta[1] / 9.0e3 - 1.0).abs() < 0.01, "{theta:?}");
    assert!(quality > 0.9999, "{quality}");

    // Section 3.4: a square describes the friction well, and a fourth order a little better.
    let lost: Vec<f64> =
        (0..n).map(|k| head[k] * RHO * G - RHO * G * (H_OUT - H_IN + level(inlet[k]))).collect();
    let power = |k: i32| -> Vec<f64> { q.iter().map(|q| q.powi(k)).collect() };
    let (_, second) = least_squares(&[power(1), power(2)], &lost);
    let (_, fourth) = least_squares(&[power(1), power(2), power(3), power(4)], &lost);
    assert!(second > 0.99 && fourth > second, "{second} {fourth}");

    // Section 3.5.1 filters for speeds at which the pump was tried at three flows.
    let mut tried: Vec<f64> = speed.clone();
    tried.dedup();
    for percent in [45.0, 52.0, 60.0, 70.0, 80.0, 90.0] {
        let flows: Vec<f64> = (0..n).filter(|&k| speed[k] == percent).map(|k| flow[k]).collect();
        let (low, high) = flows.iter().fold((f64::MAX, 0.0f64), |(l, h), &q| (l.min(q), h.max(q)));
        assert!(flows.len() > 1600 && high > 1.5 * low, "{percent} %: {low} … {high} lpm");
    }
}

#[test]
fn lags_of_meter_and_pump_make_the_return_line_look_heavier_than_it_is() {
    // Section 3.8: M q̇ = net, both sides filtered by 1/(5 s + 1), by least squares. The net pressure
    // is that of the readings, with the true pump and friction.
    let plant = Rig::field().plant;
    let table = table("booster_ramps");
    let [inlet, flow, speed] = ["p_in_A", "q_ssp", "w_ssp"].map(|name| column(&table, name));
    let q: Vec<f64> = flow.iter().map(|q| 0.951 * q * LPM).collect();
    let net = |k: usize| {
        let head = plant.c0 * (speed[k] / 100.0).powf(plant.exponent) - plant.c2 * q[k] * q[k];
        RHO * G * (H_IN - level(inlet[k]) + head - H_OUT) - plant.return_line.loss(q[k])
    };
    let filter = 5.0;
    let share = 1.0 - (-1.0f64 / filter).exp();
    let (mut filtered_q, mut filtered_net) = (q[0], net(0));
    let (mut cross, mut square) = (0.0, 0.0);
    for k in 1..q.len() {
        filtered_q += share * (q[k - 1] - filtered_q);
        filtered_net += share * (net(k - 1) - filtered_net);
        let dq = (q[k] - filtered_q) / filter;
        cross += dq * filtered_net;
        square += dq * dq;
    }
    let found = cross / square;

    // (3.15) for this line, at 155 m. A reading that lags by τ makes the net pressure err by
    // R τ q̇ with R = 2 (ρ g c2 + F2) q: of 2.6e8 Pa s²/m⁶ and 0.01 to 0.05 m³/s, and of the 2 s of
    // the meter and the 1 s of the pump, 1.6e7 to 7.8e7 kg/m⁴ more. The thesis found 0.5e8 to 1.1e8.
    let line = RHO * plant.return_line.length / plant.return_line.area();
    let inertia = line + RHO * (H_IN - 155.0) / A_R;
    assert!((inertia - 2.5e7).abs() < 0.1e7, "{inertia:e}");
    let more = found - inertia;
    assert!((1.6e7..7.8e7).contains(&more), "{found:e}");
}

#[test]
fn a_stopped_booster_pump_lets_its_line_drop_by_160_m_and_refill_in_45_s() {
    let (read, truth) = (table("booster_ramps"), table("booster_ramps.truth"));
    let [boost, fill, metered, inlet] =
        ["q_boost", "q_tf", "q_ssp", "p_in_A"].map(|name| column(&read, name));
    let [h_b, flow, delivered, pumped] =
        ["h_b", "q_ssp", "q_bo", "q_pumped"].map(|name| column(&truth, name));

    // The two long stops: the missing flow (3.10) of the readings, from before to the end of the
    // stop, fills as much of the line as is empty. It is that of a meter which lags by 2 s.
    for (before, end) in [(470, 880), (5470, 5880)] {
        let about = |k: usize| mean(inlet[k - 15..=k + 15].iter().map(|&p| level(p)));
        let missing: f64 =
            (before..end).map(|k| (0.951 * metered[k] - boost[k] - fill[k]) * LPM).sum();
        let lag = 2.0 * (flow[before] - flow[end]) * LPM;
        let drop = (missing - lag - A_R * (about(end) - about(before))) / A_B;
        // The level's two means err by √2 · 0.077 m/√31 · A_r/A_b = 0.4 m, the flow meter's by
        // √2 · 12.7 lpm/√(410/8) · 410 s/A_b = 1.7 m, and the sum by half a second of its change.
        assert!((drop - h_b[end]).abs() < 6.0, "{drop} {}", h_b[end]);
        assert!((150.0..175.0).contains(&h_b[end]), "{}", h_b[end]);

        // Mud that is pumped and does not come out fills the line: at 2200 lpm 45 s of pumping.
        let full = (end..h_b.len()).find(|&k| h_b[k] == 0.0).expect("it is full again");
        let kept: f64 = (end..full).map(|k| (pumped[k] - delivered[k]) * LPM).sum();
        assert!((kept / A_B - h_b[end]).abs() < 2.0, "{kept}");
        let seconds = h_b[end] * A_B / (2200.0 * LPM);
        assert!((42.0..50.0).contains(&seconds), "{seconds}");
    }
}

#[test]
fn a_restarted_booster_line_takes_in_a_cubic_metre_that_nobody_counted() {
    let (read, truth) = (table("booster_restarts"), table("booster_restarts.truth"));
    let [boost, fill, metered, inlet] =
        ["q_boost", "q_tf", "q_ssp", "p_in_A"].map(|name| column(&read, name));
    let [h_r, h_b, delivered, pumped] =
        ["h_r", "h_b", "q_bo", "q_pumped"].map(|name| column(&truth, name));
    let volume =
        |q: &[f64], of: &[f64]| -> f64 { q.iter().zip(of).map(|(q, of)| (q - of) * LPM).sum() };

    // From before each stop over the restart to when the line is full again and all is at rest.
    for (stop, restart, end) in [
        (480, 900, 1480),
        (1480, 1850, 2480),
        (2480, 3100, 3780),
        (3780, 3960, 4580),
        (4580, 5000, 5980),
    ] {
        // The spring shuts the outlet where the line is 12 bar, 109 m, above the riser's level.
        let drop = h_b[restart];
        assert!((h_r[restart] - drop - 109.2).abs() < 4.0, "{drop}");
        assert!((100.0..120.0).contains(&drop), "{drop}");

        // It returns to its state: what was delivered is what was pumped, to the compression of its
        // mud. But a cubic metre of that came through the charge pump, after the restart, ...
        let kept = volume(&pumped[stop..end], &delivered[stop..end]);
        assert!(h_b[stop] == 0.0 && h_b[end] == 0.0 && kept.abs() < 0.02, "{kept}");
        let uncounted = volume(&pumped[restart..end], &boost[restart..end]);
        assert!((0.85..1.15).contains(&uncounted), "{uncounted}");
        // ... and for a while more flows into the riser than is calculated (section 3.7.1).
        let excess = (restart + 2..restart + 40).map(|k| delivered[k] - boost[k]);
        let most = excess.fold(0.0, f64::max);
        assert!((100.0..300.0).contains(&most), "{most}");

        // The missing flow (3.10) of the readings says so, of stop and restart together: the level's
        // two means err by √2 · 0.077 m/√31 · A_r = 0.004 m³, the meter's by √2 · 12.7 lpm/√(T/8) · T
        // ≤ 0.05 m³ and by 1e-4 of what passed it, of 40 m³.
        let about = |k: usize| mean(inlet[k - 15..=k + 15].iter().map(|&p| level(p)));
        let missing: f64 =
            (stop..end).map(|k| (0.951 * metered[k] - boost[k] - fill[k]) * LPM).sum();
        let missing = missing - A_R * (about(end) - about(stop));
        let all = volume(&pumped[stop..end], &boost[stop..end]);
        assert!((missing - all).abs() < 0.06 && all > 1.0, "{missing} {all}");
    }
}

#[test]
fn the_outlet_valve_shuts_once_and_opens_once_and_a_steady_line_stays() {
    let plant = Rig::refitted().plant;
    for (level, boost, full, shut) in [
        (5.0, 0.0, true, true),
        (218.0, 2430.0 * LPM, true, false),
        (218.0, 1200.0 * LPM, false, false),
        (150.0, 1200.0 * LPM, true, false),
    ] {
        let start = plant.at_rest(level, boost, 0.0);
        assert_eq!((start.full, start.shut), (full, shut), "{level} {boost}");
        let end = run(&plant, start, &vec![boost; 601], 0.0, 50, |_, _, _| {});
        assert!((end.h_r - start.h_r).abs() < 1e-8 && (end.h_b - start.h_b).abs() < 1e-8);
        assert!((end.q_ssp - start.q_ssp).abs() < 1e-11 && (end.p_b - start.p_b).abs() < 0.1);
        assert_eq!((end.full, end.shut), (full, shut));
    }
    // By hand: at 1200 lpm the line is open at its top, 900 lpm come through, and the spring holds
    // more than 2100 lpm would lose, (2100/1880)² > 1 being its orifice.
    let pumping = plant.at_rest(218.0, 1200.0 * LPM, 0.0);
    assert!((pumping.q_bo / LPM - 2100.0).abs() < 1e-9);
    let lost = plant.booster_line.loss(pumping.q_bo) + 12e5 * (2100.0f64 / 1880.0).powi(2);
    assert!((pumping.h_b - (218.0 - lost / (RHO * G))).abs() < 1e-9);

    // The subsea pump holds its speed, so that the riser falls and opens the valve once more.
    let start = plant.at_rest(218.0, 2430.0 * LPM, 250.0 * LPM);
    let course = stop_and_go(2430.0 * LPM, 1000);
    let levels = |steps: u32| {
        let (mut changes, mut mode, mut empty) = (0, (true, false), 0.0);
        let end = run(&plant, start, &course, 250.0 * LPM, steps, |t, s, _| {
            changes += u32::from((s.full, s.shut) != mode);
            mode = (s.full, s.shut);
            if t == 300.0 {
                empty = s.h_b;
            }
            assert!(s.q_bo >= 0.0, "{t}: nothing flows back through the valve");
        });
        assert_eq!(changes, 4);
        [end.h_r, empty]
    };
    let ([h_r, h_b], exact) = (levels(50), levels(400));
    assert!((h_r - exact[0]).abs() < 1e-5 && (h_b - exact[1]).abs() < 1e-5);
}

#[test]
fn the_controller_keeps_the_pressure() {
    for schedule in schedules() {
        let recording = schedule.rig().record(&schedule);
        let Some(set_point) = &recording.set_point else { continue };
        let error: Vec<f64> = recording
            .rows
            .iter()
            .zip(set_point)
            .map(|(row, wanted)| row.p_r - wanted / 1e5)
            .collect();
        // At rest before the first change, to the mean of 400 readings.
        assert!(mean(error[..400].iter().copied()).abs() < 5.0 * 0.0085 / 20.0);
        // A stop takes some 45 s · 2200 lpm out of the inflow, 8 m of the riser, and the controller
        // gives back most of it; by the end nothing is left but the tail of the integral.
        let worst = error.iter().fold(0.0f64, |worst, e| worst.max(e.abs()));
        assert!(worst < 0.9, "{}: {worst}", schedule.name);
        let last = mean(error[error.len() - 100..].iter().copied());
        assert!(last.abs() < 0.25, "{}: {last}", schedule.name);
        // And the mud never flows back through the pump.
        assert!(recording.truth.iter().all(|row| row.state.q_ssp > 100.0 * LPM));
    }
}

/// Runs the rig at fixed settings with the booster flow given at every second, in so many steps a
/// second; `seen` gets every step's time and state.
fn run(
    plant: &Plant,
    start: State,
    boost: &[f64],
    top_fill: f64,
    steps: u32,
    mut seen: impl FnMut(f64, &State, &Controls),
) -> State {
    let mut state = start;
    for (k, pair) in boost.windows(2).enumerate() {
        let since = k as f64;
        let controls = Controls {
            since,
            reference: start.speed,
            speed_before: state.speed,
            boost: pair[0],
            boost_slope: pair[1] - pair[0],
            top_fill,
            damping: 2.0,
        };
        for step in 0..steps {
            let at = |step: u32| since + f64::from(step) / f64::from(steps);
            seen(at(step), &state, &controls);
            state = plant.advance(at(step), &state, &controls, at(step + 1));
        }
    }
    state
}

/// A stop of the booster pump for five minutes, from and to a flow, each ramp of 20 s.
fn stop_and_go(flow: f64, seconds: u32) -> Vec<f64> {
    let down = |t: f64| (1.0 - (t - 60.0) / 20.0).clamp(0.0, 1.0);
    let up = |t: f64| ((t - 360.0) / 20.0).clamp(0.0, 1.0);
    (0..=seconds).map(|k| flow * down(f64::from(k)).max(up(f64::from(k)))).collect()
}

#[test]
fn what_is_at_rest_stays_at_rest() {
    let plant = Rig::field().plant;
    // Standing still, with the booster line full, and with it partly empty.
    for (level, boost, top_fill) in
        [(5.0, 0.0, 0.0), (150.0, 2200.0 * LPM, 300.0 * LPM), (150.0, 1200.0 * LPM, 300.0 * LPM)]
    {
        let start = plant.at_rest(level, boost, top_fill);
        let end = run(&plant, start, &vec![boost; 1801], top_fill, 20, |_, _, _| {});
        assert!((end.h_r - start.h_r).abs() < 1e-8 && (end.h_b - start.h_b).abs() < 1e-8);
        assert!((end.q_ssp - start.q_ssp).abs() < 1e-11 && (end.p_b - start.p_b).abs() < 0.1);
        assert_eq!(end.full, start.full);
    }
    // By hand: U-tube at rest, p_b = 0 and h_b = h_r; pumping 1200 lpm, h_b = h_r − F_b(q)/(ρ g).
    assert_eq!(plant.at_rest(5.0, 0.0, 0.0).h_b, 5.0);
    let pumping = plant.at_rest(150.0, 1200.0 * LPM, 0.0);
    let lost = plant.booster_line.loss(0.97 * 1200.0 * LPM) / (RHO * G);
    assert!((pumping.h_b - (150.0 - lost)).abs() < 1e-9 && !pumping.full);
}

#[test]
fn no_mud_is_lost() {
    let plant = Rig::field().plant;
    let (flow, top_fill) = (2200.0 * LPM, 300.0 * LPM);
    let start = plant.at_rest(155.0, flow, top_fill);
    // Mud in riser and booster line, of which some is compressed.
    let stored = |s: &State| -A_R * s.h_r - A_B * s.h_b + A_B * L_B / plant.bulk_modulus * s.p_b;
    // The trapezoidal rule over each step. Its error is h²/12 times the variation of the rate's
    // slope, which is taken from the rates themselves.
    let (mut came, mut variation) = (0.0, 0.0);
    let (mut rates, mut emptiest) = ([f64::NAN; 3], 0.0f64);
    let h = 1.0 / 50.0;
    let mut tally = |t: f64, s: &State, controls: &Controls| {
        let rate = plant.pumped(controls.boost_at(t), controls.boosting(), s.p_b)
            + controls.top_fill
            - s.q_ssp;
        rates = [rates[1], rates[2], rate];
        if !rates[1].is_nan() {
            came += h * rates[1].midpoint(rates[2]);
        }
        if !rates[0].is_nan() {
            variation += (rates[2] - 2.0 * rates[1] + rates[0]).abs() / h;
        }
        emptiest = emptiest.max(s.h_b);
    };
    let end = run(&plant, start, &stop_and_go(flow, 1000), top_fill, 50, &mut tally);
    let settings = Controls {
        since: 1000.0,
        reference: start.speed,
        speed_before: start.speed,
        boost: flow,
        boost_slope: 0.0,
        top_fill,
        damping: 2.0,
    };
    tally(1000.0, &end, &settings);
    // The line emptied far and is full again.
    assert!(emptiest > 120.0 && end.full, "{emptiest} {end:?}");
    let balance = stored(&end) - stored(&start) - came;
    let bound = h * h / 12.0 * variation;
    // Of 36 m³ that went through.
    assert!(bound < 1e-4 && balance.abs() < bound, "{balance} {bound} m³");
}

#[test]
fn the_recipes_steps_are_short_enough() {
    let plant = Rig::field().plant;
    let (flow, top_fill) = (2200.0 * LPM, 300.0 * LPM);
    let start = plant.at_rest(155.0, flow, top_fill);
    let levels = |steps: u32| {
        let mut empty = 0.0;
        let end = run(&plant, start, &stop_and_go(flow, 1000), top_fill, steps, |t, s, _| {
            if t == 300.0 {
                empty = s.h_b;
            }
        });
        [end.h_r, empty]
    };
    // A hundredth of what the truth's file resolves.
    let ([h_r, h_b], exact) = (levels(50), levels(400));
    assert!(
        (h_r - exact[0]).abs() < 1e-5 && (h_b - exact[1]).abs() < 1e-5,
        "{h_r} {h_b} {exact:?}"
    );
}

#[test]
fn friction_is_that_of_the_moody_diagram() {
    let pipe = |roughness| Pipe {
        length: 100.0,
        diameter: 0.15,
        roughness,
        minor_losses: 0.0,
        viscosity: 0.012,
    };
    // f = F d/l / (ρ v²/2) at a Reynolds number.
    let factor = |pipe: Pipe, reynolds: f64| {
        let v = reynolds * pipe.viscosity / (RHO * pipe.diameter);
        pipe.loss(v * pipe.area()) * pipe.diameter / pipe.length / (RHO * v * v / 2.0)
    };
    assert!((factor(pipe(0.0), 1000.0) - 0.064).abs() < 1e-12);
    // Colebrook's equation, 1/√f = −2 log₁₀(ε/(3.7 d) + 2.51/(Re √f)), which Haaland's meets within 2 %.
    for (roughness, reynolds, moody) in [
        (0.0, 1e4, 0.030_88),
        (0.0, 1e5, 0.017_99),
        (1.5e-4, 1e5, 0.022_18),
        (1.5e-4, 1e6, 0.019_94),
    ] {
        let found = factor(pipe(roughness), reynolds);
        assert!((found / moody - 1.0).abs() < 0.02, "{reynolds}: {found}");
        let turned = moody.sqrt().recip()
            + 2.0 * (roughness / (3.7 * 0.15) + 2.51 / (reynolds * moody.sqrt())).log10();
        assert!(
            turned.abs() < 2e-3,
            "{reynolds}: the published value solves the equation, {turned}"
        );
    }
    // Backwards as forwards, and without a jump where it begins to be turbulent.
    let rough = pipe(5e-5);
    assert_eq!(rough.loss(-0.03), -rough.loss(0.03));
    for reynolds in [2300.0, 4000.0] {
        let [below, above] = [0.999_999, 1.000_001].map(|x| factor(rough, x * reynolds));
        assert!((above / below - 1.0).abs() < 1e-4, "{reynolds}: {below} {above}");
    }
}
