//! Reports of invented discoveries on a real recording.

use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_data::DiskFiles;
use dgd_data::files::write_folder;
use dgd_discover::{
    Alternative, ConditionKind, CorrelatedQuantity, Discovery, Evidence, FormulaGuess, FoundEffect,
    FoundLaw, GuessedTerm, LawParameter, LawRange, LawTerm, MissingInput, MissingPlace, NearForm,
    OutputGap, OutputTrace, ParameterValue, PlaceKind, PlainCause, PlainCauses, PlainKind,
    RankedStructure, RecordingTrace, ScreenedCandidate, SignalWindow, TraceCourse,
    UnexplainedError, Verdict, WindowCondition,
};
use dgd_runtime::{Signature, System, Unit};

use super::{DiscoverySubject, files, summary};
use crate::model::load;
use crate::request::{ModelChoices, RunRequest, StartChoice};
use crate::run::{ModelRun, PartialRun};
use crate::session::{SilentReporter, TaskContext};

#[path = "../../../../../tests/support/golden.rs"]
mod golden;

const MODEL: &str = "models/mud_circulation.dgd";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("a package of a workspace")
        .to_owned()
}

/// A run of the model over a recording.
fn request(set: &[&str]) -> RunRequest {
    let root = root();
    let mut run = RunRequest::new(root.join(MODEL));
    run.data = Some(root.join("examples/data/circulation.csv"));
    run.solve.start = StartChoice::Measured;
    run.choices.set = set.iter().map(|text| (*text).to_owned()).collect();
    run
}

/// Times, measured and simulated outputs of the recording, and the model's declarations.
struct Simulated {
    times: Vec<f64>,
    measured: Vec<Vec<f64>>,
    outputs: Vec<Vec<f64>>,
    signature: Signature,
}

fn simulated(set: &[&str]) -> Simulated {
    let request = request(set);
    let loaded = load(
        &request.model,
        &request.choices,
        &SensitivityDirections::None,
        TaskContext::new(&SilentReporter),
    );
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let run = ModelRun::prepare(&request, loaded, TaskContext::new(&SilentReporter));
    let run = run.unwrap_or_else(|error| panic!("{error}"));
    let PartialRun { solution, observations, .. } =
        run.simulate().unwrap_or_else(|e| panic!("{e}"));
    let signature = run.system.signature().clone();
    let output = |i| (0..solution.len()).map(|k| observations.w(k)[i]).collect();
    let measured = run.measured.outputs.iter().flatten().cloned().collect();
    Simulated {
        outputs: (0..signature.outputs.len()).map(output).collect(),
        times: solution.times.clone(),
        measured,
        signature,
    }
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).filter(|d| d.is_finite());
    let n = squares.clone().count();
    (squares.sum::<f64>() / n as f64).sqrt()
}

fn parameter(name: &str, symbol: &'static str, value: f64, std: Option<f64>) -> ParameterValue {
    let unit = Unit { symbol: symbol.into(), factor: 1.0, offset: 0.0 };
    ParameterValue { name: name.to_owned(), unit, value, std, std_model: None }
}

fn window(from: f64, until: f64) -> SignalWindow {
    SignalWindow { from, until, mean: 0.004, peak_sigma: 31.0 }
}

/// A missing term: zero, then a smooth hump.
fn missing(equation: &str, times: &[f64], size: f64) -> MissingInput {
    let hump = |t: f64| size * (-((t - 300.0) / 60.0).powi(2)).exp();
    MissingInput {
        place: MissingPlace {
            kind: PlaceKind::Equation,
            name: equation.to_owned(),
            unit: "m^3/s".to_owned(),
        },
        unit: "m^3/s".to_owned(),
        times: times.to_vec(),
        value: times.iter().map(|&t| hump(t) + 2e-4 * (t / 20.0).sin()).collect(),
        std: times.iter().map(|t| 3e-4 * (1.0 + (t / 200.0).cos().powi(2))).collect(),
        windows: if size == 0.0 { Vec::new() } else { vec![window(210.0, 395.0)] },
        gain: 1234.5,
    }
}

/// A condition on how a flow falls.
fn falling(quantity: &str, share_inside: f64, share_outside: f64) -> WindowCondition {
    WindowCondition {
        quantity: quantity.to_owned(),
        kind: ConditionKind::Falling,
        threshold: Some(1.9 / 60_000.0),
        unit: Unit { symbol: "lpm".into(), factor: 1.0 / 60_000.0, offset: 0.0 },
        over: Some(40.0),
        share_inside,
        share_outside,
        p_value: 0.002,
        shifts: 499,
    }
}

/// A formula that a missing flow might look like.
fn guess() -> FormulaGuess {
    FormulaGuess {
        formula: "0.0123 [1/lpm] * q_boost*abs(q_boost)".to_owned(),
        terms: vec![GuessedTerm {
            factor: "* q_boost*abs(q_boost)".to_owned(),
            coefficient: 0.0123 * 60_000.0,
            std: Some(12.0),
            unit: Unit { symbol: "1/lpm".into(), factor: 60_000.0, offset: 0.0 },
        }],
        r2_held_out: 0.872,
        is_of_recordings: true,
        left_before: 41.23,
        left_after: 1.32,
        file: "/// A formula.\neffect law on mud_circulation\n".to_owned(),
        parameters: vec![LawParameter {
            name: "law_1".to_owned(),
            value: 0.0123 * 60_000.0,
            std: Some(12.0),
            unit: Unit { symbol: "1/lpm".into(), factor: 60_000.0, offset: 0.0 },
        }],
        ranges: Vec::new(),
    }
}

/// An effect that explains a wrong shut-off head.
fn discovery() -> Discovery {
    let before = simulated(&["c0=262", "F2=1.6e8"]);
    let after = simulated(&[]);
    let outputs = &before.signature.outputs;
    let gap = outputs.iter().enumerate().map(|(i, output)| {
        let error = |run: &Simulated| rms(&run.measured[i], &run.outputs[i]);
        OutputGap {
            output: output.name.to_string(),
            unit: output.unit.clone(),
            noise: output.noise.expect("the model declares it"),
            train_before: error(&before),
            train_after: error(&after),
            valid_before: 1.07 * error(&before),
            valid_after: 1.02 * error(&after),
            condition: (output.name == "p_r").then(|| falling("q_boost", 0.94, 0.03)),
        }
    });
    let trace = |name: &str, held_out| RecordingTrace {
        name: name.to_owned(),
        held_out,
        counts_from: held_out.then_some(60.0),
        times: before.times.clone(),
        outputs: outputs
            .iter()
            .enumerate()
            .map(|(i, output)| OutputTrace {
                name: output.name.to_string(),
                unit: output.unit.clone(),
                noise: output.noise.expect("the model declares it"),
                measured: before.measured[i].clone(),
                before: before.outputs[i].clone(),
                after: after.outputs[i].clone(),
                windows: vec![window(210.0, 395.0)],
            })
            .collect(),
    };
    let base = vec![
        parameter("M_ssp", "kg/m^4", 1.093e8, Some(4.1e6)),
        parameter("c0", "m", 262.13, Some(1.84)),
        parameter("c2", "s^2/m^5", 9.0e3, None),
        parameter("F2", "Pa*s^2/m^6", 1.6021e8, Some(2.9e6)),
    ];
    let brought = parameter("k_b", "1", 0.9512, Some(0.0031));
    let brought = ParameterValue { std_model: Some(0.012), ..brought };
    let mut corrected_parameters = base.clone();
    corrected_parameters[1] = parameter("c0", "m", 275.04, Some(0.62));
    corrected_parameters.push(brought.clone());
    let ranked = |effects: &[&str], train, valid, bic, note: &str| RankedStructure {
        effects: effects.iter().map(|&name| name.to_owned()).collect(),
        train,
        valid,
        bic,
        note: note.to_owned(),
    };
    let screened = |(name, share): (&str, f64)| ScreenedCandidate { name: name.to_owned(), share };
    let text = base_text();
    let corrected = text
        .replace("q_ssp - q_boost - q_tf\n", "q_ssp - k_b*q_boost - q_tf\n")
        .replace("\nstate h_r", "parameter k_b [1] = 0.9512 in 0 .. 2 /// gain\n\nstate h_r");
    assert_ne!(text, corrected);
    Discovery {
        verdict: Verdict::Effects,
        reason: "It removes all of the excess error on validation data; no second effect passes."
            .to_owned(),
        p_value: Some(0.001),
        left_out: Vec::new(),
        given_up: None,
        lonely: Vec::new(),
        uneven: Vec::new(),
        is_cut_short: false,
        power: Vec::new(),
        not_tried: ["sensor_lag(p_r)", "sensor_lag(q_ssp)"]
            .map(|name| (name.to_owned(), "cannot be applied: `q_tf` is held".to_owned()))
            .to_vec(),
        effects: vec![FoundEffect {
            name: "booster_flow_gain".to_owned(),
            kind: "input",
            form: None,
            doc: vec![" The calculated booster flow is wrong".into(), " by a factor < 1.".into()],
            target: "q_boost".to_owned(),
            alternatives: vec![Alternative {
                name: "flow_meter_gain".to_owned(),
                form: None,
                valid_ratio: 1.0134,
            }],
            other_forms: vec![Alternative {
                name: "booster_flow_gain".to_owned(),
                form: Some("at_low_flow".to_owned()),
                valid_ratio: 1.021,
            }],
            told_apart_by: Some("a measurement of `h_r` while q_tf < 1 lpm".to_owned()),
            onset: Some(118.4),
            windows: vec![[210.0, 395.0]],
            condition: Some(falling("q_boost", 0.991, 0.004)),
            parameters: vec![brought],
            evidence: Evidence {
                p_value: 0.001,
                resamples: 999,
                bic_gain: 4821.37,
                inclusion: 0.985,
            },
        }],
        law: None,
        regime: None,
        rivals: Vec::new(),
        plain: None,
        described: Vec::new(),
        unexplained: Vec::new(),
        closed: Vec::new(),
        nowhere: None,
        gap: gap.collect(),
        traces: vec![trace("monday", false), trace("friday", true)],
        missing: vec![
            missing("riser", &before.times, 0.004),
            missing("return_line", &before.times, 0.0),
        ],
        ranking: vec![
            ranked(&["booster_flow_gain"], 1.01, Some(1.04), -4821.37, "named"),
            ranked(&["flow_meter_gain"], 1.03, Some(1.06), -4790.2, "cannot be told from it"),
            ranked(&[], 41.2, Some(44.9), 0.0, ""),
            ranked(&["pump_wear", "mud_loss"], 30.1, None, -12.0, "does not simulate"),
        ],
        screened: [("booster_flow_gain", 0.97), ("flow_meter_gain", 0.96), ("pump_wear", 0.2)]
            .map(screened)
            .to_vec(),
        base_parameters: base,
        corrected_parameters,
        corrected,
    }
}

/// The same without an effect, and with an unexplained term.
fn left_over() -> Discovery {
    let original = discovery();
    Discovery {
        verdict: Verdict::Unexplained,
        reason: "No effect of the library takes away more than 20 % of the excess error.".into(),
        effects: Vec::new(),
        unexplained: vec![UnexplainedError {
            target: "riser".to_owned(),
            is_tied: false,
            is_joint: false,
            left: Some(1.37),
            objection: None,
            told_apart_by: None,
            gain: 1234.5,
            windows: vec![[210.0, 395.0]],
            condition: Some(WindowCondition {
                kind: ConditionKind::Above,
                over: None,
                threshold: Some(1250.0 / 60_000.0),
                ..falling("q_tf", 0.9, 0.1)
            }),
            description: "up to 0.004 m³/s flow into the riser while the booster stands".into(),
            trace: original.missing[0].clone(),
            together: vec![
                CorrelatedQuantity {
                    quantity: "h_r".to_owned(),
                    course: TraceCourse::Falls,
                    r2: 0.934,
                    is_of_recordings: true,
                },
                CorrelatedQuantity {
                    quantity: "time".to_owned(),
                    course: TraceCourse::Turns,
                    r2: 0.612,
                    is_of_recordings: true,
                },
            ],
            guess: Some(guess()),
        }],
        corrected_parameters: original.base_parameters.clone(),
        corrected: base_text(),
        ..original
    }
}

fn base_text() -> String {
    fs::read_to_string(root().join(MODEL)).expect("the model is there").replace("\r\n", "\n")
}

/// Writes a report into a folder and returns the names of its files, sorted.
fn written(folder: &Path, discovery: &Discovery) -> Vec<String> {
    let choices = ModelChoices::default();
    let subject = DiscoverySubject {
        discovery,
        model: Path::new(MODEL),
        base: &base_text(),
        files: &DiskFiles,
        choices: &choices,
        training: &[PathBuf::from("monday.csv")],
        held_out: &[PathBuf::from("friday.csv")],
        reservations: &[],
        command: "dgd discover models/mud_circulation.dgd --data monday.csv --valid friday.csv",
        provenance: None,
    };
    let files = files(&subject).unwrap_or_else(|error| panic!("{error}"));
    write_folder(folder, &files).unwrap_or_else(|error| panic!("{error}"));
    let entries = fs::read_dir(folder).expect("the folder is there");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).expect("the file was written")
}

/// The same with a law instead of an effect.
fn with_a_law() -> Discovery {
    let per_minute = Unit { symbol: "1/min".into(), factor: 1.0 / 60.0, offset: 0.0 };
    let length = Unit { symbol: "m".into(), factor: 1.0, offset: 0.0 };
    let constant = |name: &str, value: f64, std: f64, unit: &Unit| LawParameter {
        name: name.to_owned(),
        value: value * unit.factor,
        std: Some(std * unit.factor),
        unit: unit.clone(),
    };
    let term = LawTerm {
        target: "riser".to_owned(),
        formula: "-0.314 [1/min] * h_r/(4.2 [m] + abs(h_r))".to_owned(),
        coefficients: vec![
            constant("law_1", -0.314, 0.002, &per_minute),
            constant("law_2", 4.2, 0.11, &length),
        ],
    };
    let near = NearForm {
        formula: "`-0.3 [1/min] * tanh(h_r/6.1 [m])` in `riser`".to_owned(),
        ratio: 1.0123,
    };
    let range = LawRange { name: "h_r".to_owned(), unit: length, low: 48.0, high: 61.5 };
    Discovery {
        verdict: Verdict::Law,
        effects: Vec::new(),
        law: Some(FoundLaw { terms: vec![term], ranges: vec![range], near: vec![near] }),
        ..discovery()
    }
}

/// The same with a wrong constant instead of an effect.
fn with_a_constant_that_is_off() -> Discovery {
    let unit =
        |symbol: &'static str, factor: f64| Unit { symbol: symbol.into(), factor, offset: 0.0 };
    let cause = |name: &str, kind, declared: f64, value: f64, std: f64, unit: &Unit| PlainCause {
        kind,
        name: name.to_owned(),
        with: None,
        declared: Some(declared * unit.factor),
        unit: Some(unit.symbol.to_string()),
        value: Some(ParameterValue {
            name: name.to_owned(),
            unit: unit.clone(),
            value: value * unit.factor,
            std: Some(std * unit.factor),
            std_model: None,
        }),
        meant_in: (kind == PlainKind::Constant).then(|| "1/min".to_owned()),
        values: Vec::new(),
        since: Vec::new(),
    };
    let causes = vec![
        cause("k", PlainKind::Constant, 0.3, 0.005, 1e-5, &unit("1/s", 1.0)),
        cause("d_r", PlainKind::Parameter, 19.75, 21.3, 0.04, &unit("in", 0.0254)),
    ];
    let effects = vec!["sensor_gain(p_r)".to_owned()];
    Discovery {
        verdict: Verdict::Plain,
        effects: Vec::new(),
        plain: Some(PlainCauses { causes, effects }),
        ..discovery()
    }
}

#[test]
fn a_discovery_is_told_to_people_and_to_programs() {
    let place = tempfile::tempdir().expect("a folder for the test");
    let goldens = root().join("tests/golden/report");
    let mut compared = golden::Goldens::default();
    for (name, discovery) in
        [("effects", discovery()), ("law", with_a_law()), ("unexplained", left_over())]
    {
        let folder = place.path().join(name);
        written(&folder, &discovery);
        compared.compare(&goldens.join(format!("{name}.json")), &read(&folder, "result.json"));
        let text = summary(&discovery, &[], Some(Path::new("found")));
        compared.compare(&goldens.join(format!("{name}.txt")), &text);
        let patch = read(&folder, "mud_circulation.diff");
        compared.compare(&goldens.join(format!("{name}.diff")), &patch);
    }
    compared.finish();
}

#[test]
fn a_number_that_is_off_is_told_with_its_unit_and_its_twins() {
    let place = tempfile::tempdir().expect("a folder for the test");
    let folder = place.path().join("plain");
    let discovery = with_a_constant_that_is_off();
    written(&folder, &discovery);
    let text = summary(&discovery, &[], Some(Path::new("found")));
    for part in [
        "The constant `k` is off: the recordings fit ",
        "and the model has 0.3 1/s. Its number is right in `1/min`: was it meant in that unit, and not in `1/s`?",
        " Or the parameter `d_r` is off (21.300 ± 0.040 in in place of 19.75 in), or there is `sensor_gain(p_r)`: ",
        "Look up where the numbers of `k` and `d_r` come from, or measure them.",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    let result: serde_json::Value =
        serde_json::from_str(&read(&folder, "result.json")).expect("a result");
    assert_eq!(result["verdict"], "plain");
    let cause = |name: &str| {
        let causes = result["plain"]["causes"].as_array().expect("causes");
        causes.iter().find(|cause| cause["name"] == name).expect("a cause").clone()
    };
    let (k, d_r) = (cause("k"), cause("d_r"));
    assert_eq!((&k["kind"], &d_r["kind"]), (&"constant".into(), &"parameter".into()));
    assert_eq!(
        (&k["value"], &k["declared"], &k["meant_in"]),
        (&0.005.into(), &0.3.into(), &"1/min".into())
    );
    assert_eq!(
        (&d_r["value"], &d_r["std"], &d_r["unit"]),
        (&21.3.into(), &0.04.into(), &"in".into())
    );
    assert_eq!(result["plain"]["effects"][0], "sensor_gain(p_r)");
    let page = read(&folder, "report.html");
    assert!(page.contains("The constant <code>k</code> is off"), "{page}");
}

#[test]
fn a_report_is_the_same_twice_and_leaves_no_stale_trace() {
    let place = tempfile::tempdir().expect("a folder for the test");
    let (first, second) = (place.path().join("a"), place.path().join("b"));
    let names = written(&first, &left_over());
    let expected = [
        "law_1.dgd",
        "mud_circulation.dgd",
        "mud_circulation.diff",
        "report.html",
        "result.json",
        "unexplained.csv",
    ];
    assert_eq!(names, expected);
    let trace = read(&first, "unexplained.csv");
    assert!(trace.starts_with("time [s],riser [m^3/s],riser_std [m^3/s]\n"), "{trace}");
    assert_eq!(written(&first, &discovery()), &expected[1..5]);
    written(&second, &discovery());
    for name in &expected[1..5] {
        assert_eq!(read(&first, name), read(&second, name), "{name}");
    }
}

#[test]
fn the_page_stands_by_itself_and_says_what_matters() {
    let place = tempfile::tempdir().expect("a folder for the test");
    let folder = place.path().join("a");
    written(&folder, &discovery());
    let page = read(&folder, "report.html");
    for part in [
        "Missing from the model: booster_flow_gain or flow_meter_gain.",
        "0.9512 ± 0.0031, model ± 0.012",
        "No covariance holds that",
        "a measurement of <code>h_r</code> while q_tf &lt; 1 lpm",
        "wrong by a factor &#60; 1.",
        "<tr class=\"added\">",
        "<tr class=\"removed\">",
        "<span class=\"added\">+parameter k_b",
        "<dt>happens</dt><dd>while <code>q_boost</code> falls by more than 1.90 lpm per second",
        "<dt><code>p_r</code></dt><dd>while <code>q_boost</code> falls",
        "--data monday.csv",
    ] {
        assert!(page.contains(part), "no {part:?}");
    }
    let (head, rest) = page.split_once("<body>").expect("a body");
    let (body, scripts) = rest.split_once("</main>").expect("an end of its contents");
    for outside in ["<script", "<link", "src=", "url(", "@import", " style="] {
        assert!(!head.contains(outside) && !body.contains(outside), "{outside:?}");
    }
    assert!(head.contains("default-src 'none'"), "the page fetches nothing");
    // One of numbers, one of code.
    assert_eq!(scripts.matches("<script").count(), 2);
    let page = body;
    let opened = |tag: &str| page.matches(&format!("<{tag}")).count();
    for tag in ["section", "table", "figure", "svg", "math", "span", "dl", "pre"] {
        let (opened, closed) = (opened(tag), page.matches(&format!("</{tag}>")).count());
        assert!(opened > 0 && opened == closed, "{tag}: {opened} and {closed}");
    }
    // Measured and simulated, and residuals, of two recordings; the missing terms.
    assert_eq!(opened("svg"), 5);
}

#[test]
fn the_page_has_a_law_with_its_range_and_near_forms() {
    let place = tempfile::tempdir().expect("a folder for the test");
    let folder = place.path().join("a");
    written(&folder, &with_a_law());
    let page = read(&folder, "report.html");
    for part in [
        "Missing from the model: <code>-0.314 [1/min] * h_r/(4.2 [m] + abs(h_r))</code> in <code>riser</code>.",
        "<h2>The law</h2>",
        "−0.3140 ± 0.0020 1/min",
        "<code>h_r</code> between 48.0 and 61.5 m",
        "(rms residual × 1.012)",
        "After: the corrected model.",
        "<span class=\"added\">+parameter k_b",
    ] {
        assert!(page.contains(part), "no {part:?}");
    }
}

#[test]
fn what_has_no_name_is_the_first_figure() {
    let place = tempfile::tempdir().expect("a folder for the test");
    let folder = place.path().join("a");
    written(&folder, &left_over());
    let page = read(&folder, "report.html");
    let position = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text:?}"));
    assert!(position("What is missing, without a name") < position("<svg"));
    assert!(position("<svg") < position("Measured and simulated"));
    assert!(!page.contains(">before</text>"), "both models are the same");
    assert!(position("After: the same, since no effect was found.") < position("<svg"));
    let guess = "a guess, not a finding: what is missing looks like \
                 <code>0.0123 [1/lpm] * q_boost*abs(q_boost)</code>; R² on validation recordings 0.87";
    assert!(position("is above 1250 lpm: 90 % of the windows") < position(guess));
    assert!(page.contains("Nothing confirms that form."));

    let mut discovery = left_over();
    discovery.unexplained[0].guess = None;
    let folder = place.path().join("b");
    written(&folder, &discovery);
    let page = read(&folder, "report.html");
    assert!(page.contains("no simple formula of the model’s names fits"));
}

#[test]
fn a_discovery_with_nothing_in_it_is_written_too() {
    let place = tempfile::tempdir().expect("a folder for the test");
    let discovery = Discovery {
        verdict: Verdict::Sufficient,
        reason: String::new(),
        p_value: None,
        left_out: Vec::new(),
        given_up: None,
        power: Vec::new(),
        lonely: Vec::new(),
        uneven: Vec::new(),
        is_cut_short: false,
        not_tried: Vec::new(),
        effects: Vec::new(),
        law: None,
        regime: None,
        rivals: Vec::new(),
        plain: None,
        described: Vec::new(),
        unexplained: Vec::new(),
        closed: Vec::new(),
        nowhere: None,
        gap: discovery()
            .gap
            .into_iter()
            .map(|gap| OutputGap {
                valid_before: f64::NAN,
                valid_after: f64::NAN,
                noise: 0.0,
                ..gap
            })
            .collect(),
        traces: Vec::new(),
        missing: Vec::new(),
        ranking: Vec::new(),
        screened: Vec::new(),
        base_parameters: Vec::new(),
        corrected_parameters: Vec::new(),
        corrected: base_text(),
    };
    let folder = place.path().join("a");
    written(&folder, &discovery);
    assert_eq!(read(&folder, "mud_circulation.diff"), "");
    assert_eq!(read(&folder, "mud_circulation.dgd"), base_text());
    assert!(read(&folder, "report.html").contains("The model explains the data"));
    let result: serde_json::Value =
        serde_json::from_str(&read(&folder, "result.json")).expect("it is JSON");
    assert_eq!(result["verdict"], "sufficient");
    assert_eq!(result["gap"]["p_r"]["unit"], "bar");
    assert!(result["gap"]["p_r"]["valid_after"].is_null());
    let text = summary(&discovery, &[], None);
    assert!(text.starts_with("The model explains the data"), "{text}");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
}
