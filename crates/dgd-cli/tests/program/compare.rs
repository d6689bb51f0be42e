//! `dgd compare`: criteria computed from single fits, nested contenders, results, and refusals.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Run, dgd_in, folder_with, listing};

const MODEL: &str = "\
model tank
input u [1] hold
parameter tau [s] = 10 in 1 .. 1000
variant mixing {
  slow { equation tank: tau * der(x) = u - x }
  fast { equation tank: 0.1 * tau * der(x) = u - x }
}
state x [1] = 2
output y [bar] = 1 [bar] * x  noise 0.01 [bar]
";

const GAIN: &str = "\
/// The sensor reads by a factor too much.
effect gain on tank
kind sensor

parameter g [1] = 1  in 0.5 .. 2
null g = 1

replace output y by g*y
";

/// Normal numbers as sums of twelve uniform ones from a multiplicative generator.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0 * 48_271 % 2_147_483_647;
            self.0 as f64 / 2_147_483_647.0
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// A tank of 20 s with a sensor of this gain, sampled every two seconds with noise of 0.01 bar.
fn recording(seed: u64, gain: f64) -> String {
    let (mut x, mut noise) = (2.0_f64, Noise(seed));
    let mut text = "time [s],u [1],y [bar]\n".to_owned();
    for k in 0..150 {
        let u = if k / 40 % 2 == 0 { 1.0 } else { 3.0 };
        let _ = writeln!(text, "{},{u},{}", 2 * k, gain * x + 0.01 * noise.next());
        x = u + (x - u) * (-2.0_f64 / 20.0).exp();
    }
    text
}

fn folder(gain: f64) -> TempDir {
    let folder = folder_with(&[
        ("m.dgd", MODEL.as_bytes()),
        ("a.csv", recording(7, gain).as_bytes()),
        ("b.csv", recording(11, gain).as_bytes()),
    ]);
    fs::create_dir(folder.path().join("effects")).expect("a folder");
    fs::write(folder.path().join("effects/gain.dgd"), GAIN).expect("an effect");
    folder
}

fn compare(folder: &TempDir, contenders: &[&str], more: &[&str]) -> Run {
    let data = ["--data", "a.csv", "--valid", "b.csv"];
    dgd_in(folder.path(), &[&["compare"], contenders, &data, more].concat())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn criteria_are_those_of_single_fits() {
    let folder = folder(1.1);
    let result = compare(&folder, &["m.dgd", "m.dgd+gain"], &["--format", "json"]).done().json();
    let fit = |apply: &[&str]| {
        let args = ["fit", "m.dgd", "--data", "a.csv", "--valid", "b.csv", "--format", "json"];
        dgd_in(folder.path(), &[&args[..], apply].concat()).done().json()
    };
    let singles = [fit(&[]), fit(&["--apply", "gain"])];
    let mut deviances = Vec::new();
    // tau and x(0), and g; a noise.
    for ((contender, single), estimates) in
        result["contenders"].as_array().expect("contenders").iter().zip(&singles).zip([3.0, 4.0])
    {
        assert_eq!(contender["parameters"], single["parameters"]);
        let output = &single["outputs"]["y"];
        let rms = number(&output["rms_train"]);
        let n = 150.0_f64;
        let deviance = n * ((2.0 * PI * rms * rms).ln() + 1.0);
        assert!((number(&contender["deviance"]) - deviance).abs() < 1e-6 * deviance.abs());
        assert_eq!(number(&contender["estimates"]), estimates);
        assert!((number(&contender["aic"]) - deviance - 2.0 * estimates).abs() < 1e-3);
        assert!((number(&contender["bic"]) - deviance - n.ln() * estimates).abs() < 1e-3);
        let valid = &contender["outputs"]["y"]["valid"];
        assert!((number(&valid["rms"]) / number(&output["rms_valid"]) - 1.0).abs() < 0.05);
        let fit_percent = number(&output["quality"]["train"]["fit_percent"]);
        let expected = number(&contender["outputs"]["y"]["train"]["fit_percent"]);
        assert!((expected - fit_percent).abs() < 1e-6, "{expected} {fit_percent}");
        deviances.push(deviance);
    }
    let ratio = &result["likelihood_ratios"][0];
    assert!((number(&ratio["statistic"]) - (deviances[0] - deviances[1])).abs() < 1e-3);
    assert_eq!(ratio["degrees_of_freedom"], 1);
    assert!(number(&ratio["p_value"]) < 1e-12, "{ratio}");
    for by in ["aic", "bic", "valid"] {
        assert_eq!(result["least"][by], "m.dgd+gain", "{by}");
    }
}

#[test]
fn what_is_not_there_does_not_pay() {
    // Without a gain the larger model is better by chance only, and the criteria penalise it.
    let folder = folder(1.0);
    let result = compare(&folder, &["m.dgd+gain", "m.dgd"], &["--format", "json"]).done().json();
    let ratio = &result["likelihood_ratios"][0];
    assert_eq!((&ratio["null"], &ratio["alternative"]), (&"m.dgd".into(), &"m.dgd+gain".into()));
    assert!(number(&ratio["statistic"]) >= -1e-6 && number(&ratio["p_value"]) > 0.001, "{ratio}");
    assert_eq!(result["least"]["bic"], "m.dgd");
}

#[test]
fn variants_and_results_are_contenders_with_text_page_and_picture() {
    let folder = folder(1.1);
    let fit = ["fit", "m.dgd", "--data", "a.csv", "--apply", "gain", "-o", "fitted"];
    dgd_in(folder.path(), &fit).done();
    let more = ["-o", "out", "--plot", "one.svg", "--plot", "two.html"];
    let run = compare(&folder, &["m.dgd@mixing=fast", "m.dgd@mixing=slow", "fitted"], &more).done();
    for part in ["A  m.dgd@mixing=fast", "C  fitted", "tau", "`fitted` has the least BIC"] {
        assert!(run.out.contains(part), "{part}: {}", run.out);
    }
    assert!(!run.out.contains("special case"), "variants are not nested");
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect(name);
    let result: Value = serde_json::from_str(&read("out/result.json")).expect("JSON");
    // The fitted fast variant is slower by the same factor: both are one model.
    let tau = |k: usize| number(&result["contenders"][k]["parameters"]["tau"]["value"]);
    assert!((tau(0) / tau(1) - 10.0).abs() < 0.01, "{} {}", tau(0), tau(1));
    assert_eq!(result["contenders"][2]["model"], "fitted/m.dgd");
    assert_eq!(listing(&folder).iter().filter(|name| *name == "one.svg").count(), 1);
    for page in ["out/report.html", "two.html"] {
        assert!(read(page).contains("<code>fitted</code> has the least BIC"), "{page}");
    }
    let nested = compare(&folder, &["m.dgd", "fitted"], &["--nested"]).done();
    assert!(nested.out.contains("`m.dgd` is a special case of `fitted`"), "{}", nested.out);
}

/// An effect that is undefined for positive x, and x is always positive.
const BROKEN: &str = "\
/// The sensor reads a root that is not there.
effect broken on tank
kind sensor

parameter b [1] = 1  in 0.5 .. 2
null b = 1

replace output y by b*y*sqrt(-x)
";

#[test]
fn one_that_fails_has_a_row_that_says_why() {
    let folder = folder(1.1);
    fs::write(folder.path().join("effects/broken.dgd"), BROKEN).expect("an effect");
    let contenders = ["m.dgd+broken", "m.dgd", "m.dgd+gain"];
    let run = compare(&folder, &contenders, &["-o", "out"]);
    run.refused(3, &["m.dgd+broken", "cannot be simulated"]);
    let rows: Vec<&str> = run.out.lines().collect();
    assert!(rows[0].starts_with("A  m.dgd+broken: the model cannot be simulated"), "{}", run.out);
    assert_eq!(rows[1..3], ["B  m.dgd", "C  m.dgd+gain"]);
    let row = rows.iter().find(|row| row.starts_with("A ") && row.ends_with("failed"));
    assert!(row.is_some_and(|row| row.contains('-')), "{}", run.out);
    assert!(run.out.contains("errors over those of B"), "{}", run.out);
    assert!(run.out.contains("`m.dgd` is a special case of `m.dgd+gain`"), "{}", run.out);
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect(name);
    let result: Value = serde_json::from_str(&read("out/result.json")).expect("JSON");
    assert_eq!(result["failed"][0]["name"], "m.dgd+broken");
    assert!(result["failed"][0]["reason"].as_str().is_some_and(|why| why.contains("simulated")));
    assert!(read("out/report.html").contains("failed: the model cannot be simulated"));
    // The others do not depend on it.
    let alone = compare(&folder, &contenders[1..], &["--format", "json"]).done().json();
    assert_eq!(result["contenders"], alone["contenders"]);
    assert_eq!(alone["failed"], Value::Array(Vec::new()));
    // If none can be fitted, the error of the first is reported.
    let twice = BROKEN.replace("broken", "worse");
    fs::write(folder.path().join("effects/worse.dgd"), twice).expect("an effect");
    compare(&folder, &["m.dgd+broken", "m.dgd+worse"], &[])
        .refused(3, &["`m.dgd+broken`: the model cannot be simulated"]);
}

#[test]
fn values_are_set_in_the_contenders_that_have_them() {
    let folder = folder(1.1);
    let fixed = ["--set", "tau=20", "--set", "g=1.1", "--fix", "tau", "--format", "json"];
    let result = compare(&folder, &["m.dgd", "m.dgd+gain"], &fixed).done().json();
    let (first, second) = (&result["contenders"][0], &result["contenders"][1]);
    assert_eq!(first["parameters"], serde_json::json!({}), "nothing but a start value");
    let gain = &second["parameters"]["g"];
    assert!((number(&gain["value"]) - 1.1).abs() < 4.0 * number(&gain["std"]), "{gain}");
    // Only an initial value, or that and a gain; and a noise.
    assert_eq!((number(&first["estimates"]), number(&second["estimates"])), (2.0, 3.0));
    compare(&folder, &["m.dgd", "m.dgd+gain"], &["--set", "h=2"]).refused(1, &["`h`"]);
}

#[test]
fn a_comparison_that_was_ended_goes_on() {
    let folder = folder(1.1);
    let contenders = ["m.dgd", "m.dgd+gain"];
    let run = compare(&folder, &contenders, &["-o", "out", "--evaluations", "2"]);
    run.refused(3, &["no minimum was reached in", "--resume"]);
    let journals = [".out.A.dgd-journal", ".out.B.dgd-journal"].map(str::to_owned);
    let kept = |folder: &TempDir| journals.iter().all(|name| listing(folder).contains(name));
    assert!(kept(&folder), "{:?}", listing(&folder));
    let read = || fs::read_to_string(folder.path().join("out/result.json")).expect("a result");
    let resumed = compare(&folder, &contenders, &["-o", "out", "--resume"]).done();
    assert!(resumed.err.contains("going on with"), "{}", resumed.err);
    assert!(journals.iter().all(|name| !listing(&folder).contains(name)), "{:?}", listing(&folder));
    let resumed = read();
    compare(&folder, &contenders, &["-o", "out"]).done();
    assert_eq!(resumed, read());
    compare(&folder, &contenders, &["--resume"]).refused(2, &["`--resume`", "-o DIR"]);
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = folder(1.0);
    compare(&folder, &["m.dgd"], &[]).refused(2, &[]);
    compare(&folder, &["m.dgd", "m.dgd"], &[]).refused(2, &["`m.dgd` is there twice"]);
    compare(&folder, &["m.dgd", "m.dgd+"], &[]).refused(2, &["nothing stands behind `+`"]);
    compare(&folder, &["m.dgd", "effects"], &[]).refused(1, &[]);
    compare(&folder, &["m.dgd", "m.dgd+leek"], &[]).refused(1, &["leek"]);
    let other = MODEL.replace("output y", "output z");
    fs::write(folder.path().join("o.dgd"), other).expect("a model");
    compare(&folder, &["m.dgd", "o.dgd"], &[]).refused(1, &["no output of one name"]);
    compare(&folder, &["m.dgd", "m.dgd+gain"], &["-o", "m.dgd"]).refused(1, &["m.dgd"]);
}
