//! `dgd invert`: the missing term of an equation, from measurements.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Run, dgd, folder_with, path};

/// A tank with a pump that extracts 0.04 m³/s.
const TANK: &str = "\
model tank
input q_in [m^3/s] linear
constant A [m^2] = 2
state h [m] = 1
equation level: A*der(h) = q_in - 0.04 [m^3/s]
output h [m] noise 2 [mm]
output p [bar] = 1000 [kg/m^3]*9.81 [m/s^2]*h
";

/// Normal deviates as sums from a linear congruential generator.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Volume lost by the leak of 0.02 m³/s from 100 to 200 s, up to t.
fn leaked(t: f64) -> f64 {
    0.02 * (t.min(200.0) - 100.0).max(0.0)
}

/// Readings of the tank with its leak, on an uneven grid, with the level in closed form.
fn tank_data(seed: u64, noise: f64) -> String {
    let mut random = Noise(seed);
    let mut text = "time [s],h [m],q_in [m^3/s]\n".to_owned();
    let mut t = 0.0;
    let turn = std::f64::consts::TAU / 60.0;
    while t <= 300.0 {
        let flown = 0.05 * t + 0.02 / turn * (1.0 - (turn * t).cos());
        let h = 1.0 + (flown - leaked(t) - 0.04 * t) / 2.0 + noise * random.normal();
        let q = 0.05 + 0.02 * (turn * t).sin();
        writeln!(text, "{t},{h:.9},{q:.9}").expect("a string");
        t += if random.uniform() < 0.7 { 0.5 } else { 1.25 };
    }
    text
}

fn folder(model: &str, data: &str) -> TempDir {
    folder_with(&[("model.dgd", model.as_bytes()), ("data.csv", data.as_bytes())])
}

fn invert(folder: &TempDir, more: &[&str]) -> Run {
    let (model, data) = (path(folder, "model.dgd"), path(folder, "data.csv"));
    dgd(&[&["invert", &model, "--data", &data], more].concat())
}

fn numbers(values: &Value) -> Vec<f64> {
    let values = values.as_array().expect("an array");
    values.iter().map(|value| value.as_f64().unwrap_or(f64::NAN)).collect()
}

fn column(result: &Value, name: &str) -> Vec<f64> {
    let mut columns = result["columns"].as_array().expect("columns").iter();
    numbers(&columns.find(|column| column["name"] == name).expect("the column")["values"])
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values.filter(|value| value.is_finite()) {
        sum += value * value;
        count += 1;
    }
    (sum / f64::from(count)).sqrt()
}

#[test]
fn a_hidden_leak_is_found_with_its_size_and_time() {
    let folder = folder(TANK, &tank_data(3, 0.002));
    let result = invert(&folder, &["--for", "level", "--format", "json"]).done().json();
    let times = numbers(&result["time"]);
    let (missing, std) = (column(&result, "missing"), column(&result, "missing_std"));
    let width = result["bandwidth"].as_f64().expect("a width");
    assert!((2.0..20.0).contains(&width), "{width}");
    assert_eq!((&result["unit"], &result["integral_unit"]), (&"m^3/s".into(), &"m^3".into()));
    // Away from the edges the result equals the leak, or zero, within its band.
    let truth = |t: f64| if (100.0..=200.0).contains(&t) { -0.02 } else { 0.0 };
    let clear = |t: f64| (t - 100.0).abs() > width && (t - 200.0).abs() > width;
    let errors = || {
        (0..times.len())
            .filter(|k| clear(times[*k]))
            .map(|k| (missing[k] - truth(times[k])) / std[k])
    };
    let off = rms(errors());
    assert!((0.6..1.5).contains(&off), "{off} standard deviations");
    let [window] = result["windows"].as_array().expect("windows").as_slice() else { panic!() };
    let window = numbers(window);
    assert!((window[0] - 100.0).abs() < width && (window[1] - 200.0).abs() < width, "{window:?}");
    // 2 m³ in total; the uncertainty is the noise of two readings times the area.
    let (sum, sum_std) = (column(&result, "integral"), column(&result, "integral_std"));
    let last = times.len() - 1;
    assert!((sum[last] + 2.0).abs() < 4.0 * sum_std[last], "{}", sum[last]);
    assert!((sum_std[last] / (2.0 * 0.002 * 2_f64.sqrt()) - 1.0).abs() < 1e-6);
}

#[test]
fn the_band_is_what_repetitions_scatter_by() {
    let args = ["--for", "level", "--bandwidth", "8 s", "--format", "json"];
    let (mut all, mut std) = (Vec::new(), 0.0);
    for seed in 1..40 {
        // The same times with other noise.
        let times: Vec<String> = tank_data(1, 0.0).lines().skip(1).map(str::to_owned).collect();
        let mut random = Noise(1000 + seed);
        let mut data = "time [s],h [m],q_in [m^3/s]\n".to_owned();
        for row in &times {
            let mut cells = row.split(',');
            let mut next =
                || cells.next().and_then(|cell| cell.parse::<f64>().ok()).expect("a cell");
            let (t, h, q) = (next(), next(), next());
            writeln!(data, "{t},{},{q}", h + 0.002 * random.normal()).expect("a string");
        }
        let result = invert(&folder(TANK, &data), &args).done().json();
        let middle = numbers(&result["time"]).partition_point(|t| *t < 50.0);
        all.push(column(&result, "missing")[middle]);
        std = column(&result, "missing_std")[middle];
    }
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let scatter = rms(all.iter().map(|value| value - mean));
    // 39 repetitions determine the scatter to a ninth.
    assert!((scatter / std - 1.0).abs() < 0.4, "{scatter} and {std}");
    assert!(mean.abs() < 4.0 * std / (all.len() as f64).sqrt() + 1e-4, "{mean}");
}

#[test]
fn the_bandwidth_can_be_asked_for_and_averages() {
    // Without noise: the mean over a window centred on the beginning of the leak is half of it.
    let folder = folder(TANK, &tank_data(5, 0.0));
    let args = ["--for", "level", "--bandwidth", "20s", "--unit", "lpm", "--format", "json"];
    let result = invert(&folder, &args).done().json();
    assert_eq!(
        (&result["bandwidth"], &result["bandwidth_from"]),
        (&20.0.into(), &"request".into())
    );
    let (times, missing) = (numbers(&result["time"]), column(&result, "missing"));
    let weight = |from: f64, until: f64| {
        let steps = 20_000;
        let h = (until - from) / f64::from(steps);
        let phi = |t: f64| (1.0 - (t / 20.0).powi(2)).powi(2);
        (0..steps).map(|k| h * phi(from + (f64::from(k) + 0.5) * h)).sum::<f64>()
    };
    for (t, found) in times.iter().zip(&missing).filter(|(t, _)| (85.0..115.0).contains(*t)) {
        let inside = weight((100.0 - t).clamp(-20.0, 20.0), 20.0) / weight(-20.0, 20.0);
        assert!((found + 1200.0 * inside).abs() < 15.0, "{found} lpm at {t} s, {inside}");
    }
    let text = invert(&folder, &["--for", "level", "--bandwidth", "20s"]).done().out;
    for part in ["± 20.00 s, as asked", "h          from h", "stands out"] {
        assert!(text.contains(part), "{part} in {text}");
    }
}

#[test]
fn what_is_not_measured_is_named() {
    let data = tank_data(3, 0.002);
    let without = data.replace("h [m],", "other [m],");
    let folder_without = folder(TANK, &without);
    invert(&folder_without, &["--for", "level"]).refused(3, &["`level`", "`h`", "not measured"]);
    // The pressure is measured.
    let by_pressure = TANK.replace("output h [m] noise 2 [mm]\n", "");
    let pressures: Vec<String> = data
        .lines()
        .enumerate()
        .map(|(k, row)| {
            let mut cells = row.split(',').map(str::to_owned).collect::<Vec<_>>();
            cells[1] = match k {
                0 => "p [bar]".to_owned(),
                _ => (0.0981 * cells[1].parse::<f64>().expect("a level")).to_string(),
            };
            cells.join(",")
        })
        .collect();
    let folder_pressure = folder(&by_pressure, &pressures.join("\n"));
    let args = ["--for", "level", "--bandwidth", "8s", "--format", "json"];
    let result = invert(&folder_pressure, &args).done().json();
    assert_eq!(result["signals"][0]["from"][0], "p");
    assert_eq!(result["sensors"][0]["noise_from"], "estimated");
    // 2 mm are 0.196 mbar.
    let noise = result["sensors"][0]["noise"].as_f64().expect("a number");
    assert!((noise / 1.962e-4 - 1.0).abs() < 0.2, "{noise}");
    let middle = numbers(&result["time"]).partition_point(|t| *t < 150.0);
    assert!((column(&result, "missing")[middle] + 0.02).abs() < 0.002);

    let folder = folder(TANK, &data);
    invert(&folder, &["--for", "levle"]).refused(2, &["`--for levle`", "`level`"]);
    invert(&folder, &["--for", "level", "--outputs", "q"]).refused(2, &["`--outputs q`"]);
    invert(&folder, &["--for", "level", "--unit", "bar"]).refused(2, &["bar", "m^3/s"]);
    invert(&folder, &["--for", "level", "--bandwidth", "0.1s"])
        .refused(3, &["--bandwidth", "0.1 s"]);
    invert(&folder, &[]).refused(2, &["--for"]);
    let exact = self::folder(&TANK.replace("0.04 [m^3/s]\n", "0.04 [m^3/s] exact\n"), &data);
    invert(&exact, &["--for", "level"]).refused(2, &["`--for level`", "exact"]);
}

#[test]
fn an_unknown_may_follow_from_another_equation() {
    // The flow is not measured, and follows from the level by the law of the outlet.
    let outlet = "\
model outlet
input q_in [m^3/s] linear
state h [m] = 1
unknown q [m^3/s]
equation level: 2 [m^2]*der(h) = q_in - q
equation law: q = 0.04 [m^3/s]*sqrt(h/1 [m])
output h [m] noise 2 [mm]
";
    let folder = folder(outlet, &tank_data(3, 0.002));
    let result = invert(&folder, &["--for", "level", "--format", "json"]).done().json();
    let signal = |name: &str| {
        let mut signals = result["signals"].as_array().expect("signals").iter();
        signals.find(|signal| signal["unknown"] == name).expect("the signal")["from"][0].clone()
    };
    assert_eq!((signal("h"), signal("q")), ("h".into(), "equation law".into()));
    // The constant 0.04 is now 0.04 √h, so 0.04 (√h − 1) is missing in addition to the leak.
    let (times, missing) = (numbers(&result["time"]), column(&result, "missing"));
    let k = times.partition_point(|t| *t < 60.0);
    let h: f64 = 1.0 + 0.01 * 60.0 / 2.0;
    assert!((missing[k] - 0.04 * (h.sqrt() - 1.0)).abs() < 0.003, "{}", missing[k]);
    // The law itself cannot be inverted, because no other equation gives the flow.
    invert(&folder, &["--for", "law"]).refused(3, &["`law`", "`q`", "not measured"]);
    // With a flow meter it can: the term is 0.04 minus the law, and an algebraic equation has no integral.
    let metered = outlet.to_owned() + "output q [m^3/s] noise 1e-4 [m^3/s]\n";
    let rows = tank_data(3, 0.002);
    let rows = rows.lines().enumerate();
    let rows: Vec<String> = rows
        .map(|(k, row)| format!("{row},{}", if k == 0 { "q [m^3/s]" } else { "0.04" }))
        .collect();
    let metered = self::folder(&metered, &rows.join("\n"));
    let args = ["--for", "law", "--bandwidth", "5s", "--format", "json"];
    let result = invert(&metered, &args).done().json();
    assert_eq!(result["integral_unit"], Value::Null);
    let value = column(&result, "missing")[k];
    assert!((value - 0.04 * (1.0 - h.sqrt())).abs() < 5e-4, "{value}");
}

/// Columns of a table of the repository, by name without unit.
fn table(text: &str) -> impl Fn(&str) -> Vec<f64> + use<> {
    let heads: Vec<String> = text
        .lines()
        .next()
        .unwrap_or_default()
        .split(',')
        .map(|head| head.split(" [").next().unwrap_or_default().to_owned())
        .collect();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|row| row.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect())
        .collect();
    move |name| {
        let value_at =
            heads.iter().position(|head| head == name).unwrap_or_else(|| panic!("{name}"));
        rows.iter().map(|row| row[value_at]).collect()
    }
}

fn unzipped(file: &str) -> String {
    use std::io::Read as _;
    let bytes = fs::read(crate::support::root().join(file)).expect("the recording");
    let mut text = String::new();
    flate2::read::GzDecoder::new(&bytes[..]).read_to_string(&mut text).expect("text");
    text
}

#[test]
fn the_flow_that_the_riser_misses_is_the_true_one() {
    // Equation 3.10 of the thesis, for a stop and a restart of the booster pump; the recording has the true flows.
    let window = ["--from", "440", "--until", "1440", "--with-estimate", "--format", "json"];
    let model = ["invert", "examples/thesis/riser_and_booster.dgd", "--variant", "line=none"];
    let data = [
        "--data",
        "examples/data/field/booster_restarts.csv.gz",
        "--for",
        "riser",
        "--unit",
        "lpm",
    ];
    let result = dgd(&[&model[..], &data, &window].concat()).done().json();
    let (times, missing) = (numbers(&result["time"]), column(&result, "missing"));
    let (truth, recording) = (
        table(&unzipped("examples/data/field/booster_restarts.truth.csv.gz")),
        table(&unzipped("examples/data/field/booster_restarts.csv.gz")),
    );
    let (true_times, delivered, calculated) = (truth("time"), truth("q_bo"), recording("q_boost"));
    let value_at = |t: f64| true_times.partition_point(|own| *own < t);
    let wanted: Vec<f64> =
        times.iter().map(|t| calculated[value_at(*t)] - delivered[value_at(*t)]).collect();
    let size = rms(wanted.iter().copied());
    let off = rms(missing.iter().zip(&wanted).map(|(found, wanted)| found - wanted));
    assert!(off < 0.2 * size, "{off} lpm of {size}");
    // The smoothed estimate of discoveries agrees.
    let estimate = column(&result, "estimate");
    let apart = rms(missing.iter().zip(&estimate).map(|(found, estimate)| found - estimate));
    assert!(apart < 0.1 * size, "{apart} lpm of {size}");
    // Computed independently, in cubic metres: θ ∫ q_ssp − ∫ q_boost − ∫ q_tf − A_r Δh.
    let [q, boost, fill, p] = ["q_ssp", "q_boost", "q_tf", "p_r"].map(&recording);
    let (first, last) = (value_at(440.0), value_at(times[times.len() - 1]));
    let flow = |k: usize| (0.951 * q[k] - boost[k] - fill[k]) / 60_000.0;
    let flown: f64 = (first..last).map(|k| 0.5 * (flow(k) + flow(k + 1))).sum();
    let area = std::f64::consts::FRAC_PI_4 * (19.75_f64 * 0.0254).powi(2);
    let level = |k: usize| 305.0 - (p[k] * 1e5 - 101_325.0) / (1120.0 * 9.81);
    let by_hand = area * (level(last) - level(first)) - flown;
    let sum = column(&result, "integral");
    assert!((sum[sum.len() - 1] - by_hand).abs() < 1e-6, "{} and {by_hand}", sum[sum.len() - 1]);
}

#[test]
fn it_is_drawn_and_written() {
    let folder = folder(TANK, &tank_data(3, 0.002));
    let (picture, out) = (path(&folder, "missing.svg"), path(&folder, "missing.csv"));
    let args = ["--for", "level", "--with-estimate", "--plot", &picture, "-o", &out];
    invert(&folder, &args).done();
    let svg = fs::read_to_string(&picture).expect("a picture");
    for part in ["Missing in level", "estimated by a smoother", "Its integral"] {
        assert!(svg.contains(part), "{part}");
    }
    let table = fs::read_to_string(&out).expect("a table");
    let head = "time [s],missing [m^3/s],missing_std [m^3/s],integral [m^3],integral_std [m^3],\
                estimate [m^3/s],estimate_std [m^3/s]\n";
    assert!(table.starts_with(head), "{}", table.lines().next().unwrap_or_default());
}
