//! `dgd discover`: its files, and its refusals.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use serde_json::{Value, json};

use crate::names::nothing_vanishes;
use crate::support::{Run, dgd, dgd_in, folder_with, killed_and_resumed, listing, path, root};

#[cfg(target_os = "linux")]
use crate::support::{interrupt, started, wait_until_it_minds_ctrl_c};

const MODEL: &str = "models/mud_circulation.dgd";
const TRAIN: &str = "examples/data/booster_stop.train.csv";
const VALID: &str = "examples/data/booster_stop.valid.csv";

fn discover(more: &[&str]) -> Run {
    dgd(&[&["discover", MODEL, "--data", TRAIN], more].concat())
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[track_caller]
fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn a_discovery_writes_what_it_found() {
    let parent = folder_with(&[]);
    let folder = parent.path().join("found");
    let goal = folder.display().to_string();
    let files = ["mud_circulation.dgd", "mud_circulation.diff", "report.html", "result.json"];
    let run = discover(&["--valid", VALID, "--format", "json", "-o", &goal]).done();
    let written = files.map(|name| read(&folder, name));
    let mut names: Vec<String> = fs::read_dir(&folder)
        .expect("it was written")
        .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, files);
    assert_eq!(run.out, written[3], "standard output has the result as well");

    result_is_right(&run.json());
    nothing_vanishes(&run.json(), &root().join("models/effects"));
    model_stands_by_itself(&folder);
    let base = read(&root(), MODEL);
    assert_eq!(patched(&base, &written[1]), written[0]);
    page_is_whole(&written[2], &goal);
}

/// The discovery in the first 700 s, run quietly over an older result: standard output and error, and the result. Run
/// once for all tests that use it.
fn short_one() -> &'static (Run, Value) {
    static FOUND: OnceLock<(Run, Value)> = OnceLock::new();
    FOUND.get_or_init(|| {
        let parent = folder_with(&[]);
        let goal = path(&parent, "found");
        fs::create_dir(&goal).expect("a folder");
        fs::write(Path::new(&goal).join("result.json"), "{}").expect("an older result");
        let run = discover(&["--until", "700", "--quiet", "-o", &goal]).done();
        let result = read(Path::new(&goal), "result.json");
        (run, serde_json::from_str(&result).expect("JSON"))
    })
}

fn result_is_right(result: &Value) {
    assert_eq!(result["verdict"], "effects");
    assert_eq!(result["unexplained"], json!([]));
    let [effect] = result["effects"].as_array().expect("a list").as_slice() else {
        panic!("one effect is hidden: {}", result["effects"])
    };
    assert_eq!(effect["name"], "booster_u_tubing");
    assert_eq!(effect["kind"], "plant");
    assert_eq!(effect["form"], "column_with_momentum");
    assert_eq!(effect["target"], "riser");
    assert_eq!(effect["onset"], Value::Null);
    assert_eq!(effect["alternatives"], json!([]));
    assert_eq!(effect["told_apart_by"], Value::Null);

    // The windows equal the true ones to ten seconds, because a window fades out.
    let windows = effect["windows"].as_array().expect("a list");
    let truth = [[384.0, 529.0], [804.0, 841.0], [1936.0, 2079.0], [2362.0, 2401.0]];
    assert_eq!(windows.len(), truth.len(), "{windows:?}");
    for (window, truth) in windows.iter().zip(truth) {
        for (end, truth) in [(&window[0], truth[0]), (&window[1], truth[1])] {
            assert!((number(end) - truth).abs() < 10.0, "{windows:?}");
        }
    }

    // The line drains when the booster pump stops; where it starts, windows are short.
    let condition = &effect["condition"];
    assert_eq!(
        (&condition["quantity"], &condition["kind"]),
        (&json!("q_boost"), &json!("falling"))
    );
    assert_eq!(condition["unit"], "lpm/s");
    let [inside, outside] = ["share_inside", "share_outside"].map(|name| number(&condition[name]));
    assert!(inside > 0.7 && outside < 0.05, "{condition}");
    assert!(number(&condition["p_value"]) <= 0.05, "{condition}");

    let friction = &effect["parameters"]["F_b"];
    assert_eq!(friction["unit"], "Pa*s/m^3");
    assert!(number(&friction["std"]) < 0.02 * number(&friction["value"]));
    // The true value, with an inertia of the line that differs by 20 % from the effect's.
    assert!((number(&friction["value"]) / 6.8148e7 - 1.0).abs() < 0.03, "{friction}");

    let evidence = &effect["evidence"];
    let resamples = number(&evidence["resamples"]);
    assert!(resamples >= 99.0);
    let p_value = number(&evidence["p_value"]);
    assert!((1.0 / (resamples + 1.0) - 1e-9..0.01).contains(&p_value), "{evidence}");
    assert!(number(&evidence["bic_gain"]) > 100.0);
    assert!((0.9..=1.0).contains(&number(&evidence["inclusion"])));

    let gap = result["gap"].as_object().expect("an object");
    for (output, unit, noise) in [
        ("p_r", "bar", 0.008),
        ("p_in", "bar", 0.01),
        ("p_out", "bar", 0.01),
        ("q_ssp", "lpm", 14.0),
    ] {
        let gap = &gap[output];
        assert_eq!(gap["unit"], unit);
        // 2700 samples determine the noise to 1.5 %.
        let estimated = number(&gap["noise"]);
        assert!((estimated / noise - 1.0).abs() < 0.06, "{output}: {estimated}");
        for part in ["train", "valid"] {
            let (before, after) =
                (number(&gap[format!("{part}_before")]), number(&gap[format!("{part}_after")]));
            assert!(before > 2.0 * estimated, "{output}: {before}");
            assert!((0.8..1.2).contains(&(after / estimated)), "{output}: {after}");
        }
    }
    assert_eq!(gap.len(), 4);
}

/// The corrected model checks, is formatted, and simulates without the library.
fn model_stands_by_itself(folder: &Path) {
    let check = dgd_in(folder, &["check", "mud_circulation.dgd"]).done();
    assert!(check.err.contains("modes booster_line"), "{}", check.err);
    dgd_in(folder, &["fmt", "--check", "mud_circulation.dgd"]).done();
    let data = root().join(TRAIN).display().to_string();
    let args = ["simulate", "mud_circulation.dgd", "--data", &data, "--until", "60"];
    dgd_in(folder, &args).done();

    // A new fit gives its own numbers.
    let result: Value = serde_json::from_str(&read(folder, "result.json")).expect("JSON");
    let args = ["fit", "mud_circulation.dgd", "--data", &data, "--format", "json"];
    let refitted = dgd_in(folder, &args).done().json();
    let refitted = refitted["parameters"].as_object().expect("an object");
    assert_eq!(refitted.len(), 5, "{refitted:?}");
    for (name, refitted) in refitted {
        let (result, again) = (&result["parameters"][name]["value"], number(&refitted["value"]));
        assert!((again / number(result) - 1.0).abs() < 1e-6, "{name}: {result}, then {again}");
    }
}

/// A text with a unified diff applied, which must match exactly.
fn patched(base: &str, diff: &str) -> String {
    let base: Vec<&str> = base.split_inclusive('\n').collect();
    let mut text = String::new();
    let mut position = 0;
    for line in diff.split_inclusive('\n').skip(2) {
        let (mark, content) = line.split_at(1);
        match mark {
            "@" => {
                // @@ -FIRST,LENGTH +FIRST,LENGTH @@
                let first = content.split(['-', ',']).nth(1).expect("where the hunk begins");
                let begins = first.parse::<usize>().expect("a number") - 1;
                text.extend(base[position..begins].iter().copied());
                position = begins;
            }
            "+" => text.push_str(content),
            _ => {
                assert_eq!(base[position], content);
                position += 1;
                if mark == " " {
                    text.push_str(content);
                }
            }
        }
    }
    text.extend(base[position..].iter().copied());
    text
}

fn page_is_whole(page: &str, goal: &str) {
    for part in [
        "Missing from the model: booster_u_tubing",
        "<h2>The gap",
        "<h2>Measured and simulated",
        "<h2>Simulation errors",
        "<h2>What each equation would have needed",
        "<h2>Structures that were refitted",
        "<h2>Equations",
        "<h2>Parameters",
        "<h2>The change of",
        "<math",
        "booster_stop.train.csv",
        "booster_stop.valid.csv",
        "384–",
        goal,
    ] {
        assert!(page.contains(part), "no {part:?}");
    }
    // Measurements, residuals and missing terms of two recordings.
    assert!(page.matches("<svg").count() >= 5);
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    // The page is self-contained, and runs only its own script.
    assert_eq!(page.matches("<script").count(), 2, "one of numbers, one of code");
    let (_, page) = page.split_once("<body>").expect("a body");
    let (page, _) = page.split_once("</main>").expect("its contents end");
    for foreign in ["<script", "<link", "<img", "<iframe", "@import", "src=", "url(", "onload"] {
        assert!(!page.contains(foreign), "{foreign:?} in the page");
    }
    let addresses = page.matches("http").count();
    let namespaces = page.matches("xmlns=\"http://www.w3.org/").count();
    assert_eq!(addresses, namespaces, "no address but names of XML");
}

#[test]
fn quiet_says_nothing_where_a_folder_has_it() {
    let (run, result) = short_one();
    assert_eq!((run.out.as_str(), run.err.as_str()), ("", ""));
    assert_eq!(result["effects"][0]["name"], "booster_u_tubing");
    assert_eq!(result["gap"]["p_r"]["valid_after"], Value::Null, "nothing was held out");
}

#[test]
fn the_short_of_it_is_printed() {
    let run = discover(&["--until", "700"]).done();
    let mut lines = run.out.lines();
    assert_eq!(lines.next(), Some("Missing from the model: booster_u_tubing."));
    for part in ["F_b", "active", "evidence", "simulation error", "q_ssp"] {
        assert!(run.out.contains(part), "no {part:?} in\n{}", run.out);
    }
    assert!(!run.out.contains("report:"), "nothing was written");
}

#[test]
fn with_its_effect_applied_nothing_is_missing() {
    let more =
        ["--until", "700", "--apply", "booster_u_tubing/column_with_momentum", "--format", "json"];
    let result = discover(&more).done().json();
    assert_eq!(result["verdict"], "sufficient");
    assert_eq!(result["effects"], json!([]));
    nothing_vanishes(&result, &root().join("models/effects"));
    let friction = number(&result["parameters"]["F_b"]["value"]);
    assert!((friction / 6.8148e7 - 1.0).abs() < 0.05, "{friction}");
}

/// The discovery of an effect hidden in a simulation of the model itself, with noise.
fn found_in_own(inputs: &str, hide: &[&str], base: &[&str]) -> Value {
    let folder = folder_with(&[]);
    let data = path(&folder, "hidden.csv");
    let args = ["simulate", MODEL, "--data", inputs, "--noise-seed", "3", "-o", &data];
    dgd(&[&args[..], hide].concat()).done();
    let args = ["discover", MODEL, "--data", &data, "--format", "json"];
    dgd(&[&args[..], base].concat()).done().json()
}

#[test]
fn each_form_of_u_tubing_is_told_from_the_others() {
    let forms = [
        ("column_with_momentum", &[("F_b", 6e7)][..]),
        ("weighted_column", &[("F_b", 6e7), ("theta_hb", 1.5), ("theta_b", 3.6)]),
        ("delay_and_integrator", &[("tau_d", 30.0), ("tau_b", 10.0), ("theta_i", 0.05)]),
    ];
    for (form, truth) in forms {
        // The riser is 200 m deep, and the base model's pump is slightly weaker than the true one.
        let form_of_it = format!("booster_u_tubing/{form}");
        let hide = ["--apply", &form_of_it, "--set", "c0=400", "--set", "h_r=200"];
        let result = found_in_own("examples/data/case_2.csv", &hide, &["--set", "c0=390"]);
        let [effect] = result["effects"].as_array().expect("a list").as_slice() else {
            panic!("{form} is hidden: {}, {}", result["effects"], result["reason"])
        };
        assert_eq!((&effect["name"], &effect["form"]), (&json!("booster_u_tubing"), &json!(form)));
        assert_eq!(effect["alternatives"], json!([]));
        for (name, truth) in truth {
            let estimate = &effect["parameters"][name];
            let (value, std) = (number(&estimate["value"]), number(&estimate["std"]));
            assert!((value - truth).abs() < 4.0 * std, "{form}: {name} = {value} ± {std}");
            assert!(std < 0.05 * truth, "{form}: {name} is known to {std} only");
        }
    }
}

#[test]
fn friction_of_higher_order_is_found_alone() {
    // The terms of the second effect nearly cancel, and the screen overestimates it.
    for (f3, f4) in [(3e9, 0.0), (-2e9, 8e10)] {
        let (f3_set, f4_set) = (format!("F3={f3}"), format!("F4={f4}"));
        let hide = ["--apply", "friction_higher_order", "--set", &f3_set, "--set", &f4_set];
        let result = found_in_own("examples/data/circulation.csv", &hide, &[]);
        let [effect] = result["effects"].as_array().expect("a list").as_slice() else {
            panic!("one effect is hidden: {}, {}", result["effects"], result["reason"])
        };
        assert_eq!(effect["name"], "friction_higher_order");
        for (name, truth) in [("F3", f3), ("F4", f4)] {
            let estimate = &effect["parameters"][name];
            let (value, std) = (number(&estimate["value"]), number(&estimate["std"]));
            assert!((value - truth).abs() < 4.0 * std, "{name} = {value} ± {std}, not {truth}");
        }
    }
}

#[test]
fn without_effects_only_the_verdict_is_left() {
    let model = fs::read(root().join(MODEL)).expect("the model");
    let folder = folder_with(&[("mud_circulation.dgd", &model)]);
    let (alone, data) = (path(&folder, "mud_circulation.dgd"), root().join(TRAIN));
    let data = data.display().to_string();
    let options = ["--until", "700", "--format", "json"];
    let judged = dgd(&[&["discover", &alone, "--data", &data][..], &options].concat()).done();
    assert_eq!(judged.json()["verdict"], "unexplained");
    let remark = ["no effects of this model", "only templates", "`effects`", "--effects"];
    assert!(remark.iter().all(|part| judged.err.contains(part)), "{}", judged.err);
    discover(&["--effects", "nowhere"]).refused(2, &["--effects nowhere", "no such folder"]);
    let empty = path(&folder, "none");
    fs::create_dir(&empty).expect("a folder");
    dgd(&["discover", &alone, "--data", &data, "--effects", &empty])
        .refused(2, &["no effects", "`--effects`"]);
    fs::remove_dir(&empty).expect("the folder");
    assert_eq!(listing(&folder), ["mud_circulation.dgd"]);

    // A library that is named counts like one beside the model.
    let library = root().join("models/effects").display().to_string();
    let result = dgd(&[
        "discover",
        &alone,
        "--data",
        &data,
        "--until",
        "700",
        "--effects",
        &library,
        "--format",
        "json",
    ]);
    assert_eq!(result.done().json()["effects"], short_one().1["effects"]);
}

#[test]
fn what_is_wrong_is_shown_where_it_is() {
    let parent = folder_with(&[(
        "leak.dgd",
        b"effect leak on mud_circulation\nkind plant\n\nadd k k to riser\n",
    )]);
    let goal = path(&parent, "found");
    let effects = parent.path().display().to_string();
    discover(&["--effects", &effects, "-o", &goal]).refused(1, &["E105", "leak.dgd:4:7"]);
    discover(&["--valid", "nowhere.csv", "-o", &goal]).refused(1, &["E601", "nowhere.csv"]);
    dgd(&["discover", MODEL, "--data", "nowhere.csv"]).refused(1, &["E601", "nowhere.csv"]);
    dgd(&["discover", MODEL]).refused(2, &["--data"]);
    discover(&["--apply", "mud_los"]).refused(1, &["did you mean `mud_loss`?"]);
    discover(&["-o", "models"]).refused(2, &["would replace", "which this command reads"]);
    assert_eq!(listing(&parent), ["leak.dgd"], "nothing was written");
}

#[test]
fn an_effect_reads_a_column_that_the_model_does_not_or_is_left_out() {
    let head = "model tank\n\ninput q [m^3/s] hold\ninput T [degC] hold\n\nparameter a [1/s] = 0.1  in 0 .. 10\n\n\
                state h [m] = 1\n\n";
    let unread = format!("{head}equation level: der(h) = q/(1 [m^2]) - a*h\n\noutput h [m]\n");
    let other_choice = format!(
        "{head}variant law {{\n  cold {{ equation level: der(h) = q/(1 [m^2]) - a*h }}\n  \
         warm {{ equation level: der(h) = q/(1 [m^2]) - a*h*(T/(293.15 [K])) }}\n}}\n\noutput h [m]\n"
    );
    let effect =
        b"effect heat on tank\nkind plant\n\nparameter by_T [m/(s*K)] = 0\nnull by_T = 0\n\n\
                   add by_T*(T - 20 [degC]) to level\n";
    // Exact steps of ḣ = q − a h + 0.002 (T − 20), with a noise of a few millimetres.
    let (mut with, mut without) =
        ("time [s],q [m^3/s],T [degC],h [m]\n".to_owned(), "time [s],q [m^3/s],h [m]\n".to_owned());
    let mut h = 1.0;
    for k in 0..600_usize {
        let (q, t) = (0.05 + 0.05 * (k / 40 % 3) as f64, 20.0 + 15.0 * (k / 75 % 2) as f64);
        let noise =
            [0.003, -0.004, 0.001, -0.001, 0.004, -0.003, 0.0, 0.002, -0.002, 0.005, -0.005];
        let read = h + noise[k * k % 11] * [1.0, -1.0, 0.5][k % 3];
        let _ = writeln!(with, "{k},{q},{t},{read}");
        let _ = writeln!(without, "{k},{q},{read}");
        let rest = 10.0 * (q + 0.002 * (t - 20.0));
        h = rest + (h - rest) * (-0.1_f64).exp();
    }
    let folder = folder_with(&[
        ("unread.dgd", unread.as_bytes()),
        ("other.dgd", other_choice.as_bytes()),
        ("with.csv", with.as_bytes()),
        ("without.csv", without.as_bytes()),
    ]);
    let library = folder_with(&[("heat.dgd", effect)]);
    let effects = library.path().display().to_string();
    for model in ["unread.dgd", "other.dgd"] {
        let model = path(&folder, model);
        let run = |data: &str| {
            let data = path(&folder, data);
            let args = ["discover", &model, "--data", &data, "--effects", &effects];
            dgd(&[&args[..], &["--format", "json"]].concat()).done().json()
        };
        let result = run("with.csv");
        assert_eq!(result["effects"][0]["name"], "heat", "{}", result["reason"]);
        let size = number(&result["effects"][0]["parameters"]["by_T"]["value"]);
        assert!((size / 0.002 - 1.0).abs() < 0.05, "{size}");
        let text = result["reservations"].as_array().expect("a list");
        let [only] = text.as_slice() else { panic!("{text:?}") };
        assert!(only.as_str().is_some_and(|words| words.contains("no validation data")), "{only}");
        let left = run("without.csv");
        let words = left["reservations"][0].as_str().expect("words");
        assert_eq!(
            words,
            "the effect `heat` reads `T`, of which the recordings have no column: it is left out"
        );
        assert_ne!(left["verdict"], "sufficient");
    }
}

/// Three hours of a cell with a drifting voltmeter.
fn cell(seed: u64) -> String {
    let mut state = seed;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    };
    let mut text = "time [h],i [A],v [mV]\n".to_owned();
    let (mut soc, mut v1, mut i) = (0.9, 0.0, 0.0);
    for k in 0..600 {
        let t = f64::from(k) * 0.005;
        if k % 40 == 0 {
            i = [0.0, 0.5, 1.0, 1.5, 2.0, -0.6][(6.0 * uniform()) as usize];
        }
        // A sum of twelve uniform numbers is nearly normal.
        let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let v = 3.0 + 1.1 * soc - 0.05 * i - v1;
        let _ = writeln!(text, "{t},{i},{}", 1000.0 * v + 4.0 * t + noise);
        for _ in 0..20 {
            soc -= 0.9 * i / 9000.0;
            v1 += 0.9 * (0.02 * i - v1) / 300.0;
        }
    }
    text
}

#[test]
fn a_model_whose_start_values_are_all_fixed_is_examined() {
    let model = "model cell\ninput i [A] hold\nconstant Q [A*h] = 2.5\n\
                 parameter E0 [V] = 3.1 in 2 .. 4\nparameter E1 [V] = 1 in 0 .. 3\n\
                 parameter R0 [mOhm] = 40 in 1 .. 500, log\nparameter R1 [mOhm] = 30 in 1 .. 500, log\n\
                 parameter tau [min] = 4 in 0.1 .. 60, log\nstate soc [%] = 90 fixed\n\
                 state v1 [mV] = 0 fixed\nequation charge: Q*der(soc) = -i\n\
                 equation relax: tau*der(v1) = R1*i - v1\n\
                 output v [V] = E0 + E1*soc - R0*i - v1 noise 1 [mV]\n";
    let (train, valid) = (cell(1), cell(2));
    let folder = folder_with(&[
        ("cell.dgd", model.as_bytes()),
        ("train.csv", train.as_bytes()),
        ("valid.csv", valid.as_bytes()),
    ]);
    let [model, train, valid] =
        ["cell.dgd", "train.csv", "valid.csv"].map(|name| path(&folder, name));
    let args = ["discover", &model, "--data", &train, "--valid", &valid, "--format", "json"];
    let result = dgd(&args).done().json();
    // The drift hides in the model's parameters on the training data, and shows on the validation data. For the
    // voltage, a constant current is equivalent.
    assert_eq!(result["verdict"], "unexplained", "{}", result["reason"]);
    let [law, .., drift] = &result["rivals"].as_array().expect("rivals")[..] else {
        panic!("{}", result["rivals"])
    };
    assert_eq!(law["terms"][0]["target"], "charge", "{law}");
    assert_eq!(drift["effects"][0], "sensor_drift(v)", "{drift}");
    assert_eq!(drift["told_apart_by"], "a second sensor of `v`");
    assert!(
        number(&result["gap"]["v"]["valid_before"]) > 2.0 * number(&result["gap"]["v"]["noise"])
    );
}

#[test]
fn what_recordings_cannot_tell_is_said() {
    let model = "model tank\n\ninput q [m^3/s] hold\n\nparameter a [1/s] = 0.1  in 0 .. 10\n\n\
                 state h [m] = 1\n\nequation level: der(h) = q/(1 [m^2]) - a*h\n\noutput h [m]\n";
    // The output rises where the model settles, in steps that look like noise.
    let rows = |n: usize, q: fn(usize) -> f64, h: fn(f64) -> f64| {
        let mut text = "time [s],q [m^3/s],h [m]\n".to_owned();
        for k in 0..n {
            let noise =
                [0.003, -0.004, 0.001, -0.001, 0.004, -0.003, 0.002][(k * k + 3 * (k / 7)) % 7];
            let _ = writeln!(text, "{k},{},{}", q(k), h(k as f64) + noise);
        }
        text
    };
    let few = rows(20, |_| 0.05, |t| 1.0 + 0.01 * t * t);
    let settled = rows(60, |_| 0.05, |t| 0.5 + 0.5 * (-0.1 * t).exp());
    let again: Vec<&str> = settled.lines().take(50).collect();
    let again = again.join("\n") + "\n";
    let folder = folder_with(&[
        ("tank.dgd", model.as_bytes()),
        ("few.csv", few.as_bytes()),
        ("settled.csv", settled.as_bytes()),
        ("again.csv", again.as_bytes()),
    ]);
    let path = |name: &str| path(&folder, name);
    let run = |data: &str, more: &[&str]| {
        let (model, data) = (path("tank.dgd"), path(data));
        dgd(&[&["discover", &model, "--data", &data], more].concat()).done()
    };
    // So few samples pass every test except that of the size of their residuals.
    let short = run("few.csv", &["--format", "json"]).json();
    assert_ne!(short["verdict"], "sufficient", "{short}");
    let text = run("few.csv", &[]).out;
    assert!(text.contains("But no recording has more than 20 samples of an output"), "{text}");

    let valid = path("again.csv");
    let run = run("settled.csv", &["--valid", &valid, "--format", "json"]).json();
    assert_eq!(run["verdict"], "sufficient");
    let words: Vec<&str> = (run["reservations"].as_array().expect("a list").iter())
        .map(|words| words.as_str().expect("words"))
        .collect();
    let [at_rest, repeated, none] = words.as_slice() else { panic!("{words:?}") };
    assert!(none.contains("no validation data"), "{none}");
    assert!(at_rest.starts_with("no input moves in any recording"), "{at_rest}");
    assert!(
        repeated.contains("again.csv are rows of") && repeated.contains("left out"),
        "{repeated}"
    );
    assert_eq!(run["recordings"].as_array().expect("a list").len(), 1);
}

#[test]
fn recordings_must_measure_an_output() {
    let inputs = b"time [s],w_ssp [%],q_boost [lpm],q_tf [lpm]\n0,50,1500,200\n1,50,1500,200\n";
    let folder = folder_with(&[("inputs.csv", inputs)]);
    let data = path(&folder, "inputs.csv");
    dgd(&["discover", MODEL, "--data", &data]).refused(1, &["measured"]);
}

#[test]
fn the_story_of_the_thesis_is_found_in_the_stand_in_for_its_recordings() {
    let [train, valid] = ["booster_ramps", "normal_circulation"].map(|name| {
        root().join(format!("examples/data/field/{name}.csv.gz")).display().to_string()
    });
    let model = root().join(MODEL).display().to_string();
    let args = ["discover", &model, "--data", &train, "--valid", &valid, "--format", "json"];
    let story = dgd(&args).done().json();
    // The rig is richer than the model with all effects: something smaller is left over and reported.
    assert_eq!(story["verdict"], "effects", "{}", story["reason"]);
    let names: Vec<&str> = (story["effects"].as_array().expect("a list").iter())
        .map(|effect| effect["name"].as_str().expect("a name"))
        .collect();
    assert_eq!(names, ["booster_u_tubing", "flow_meter_gain", "pump_speed_exponent"]);
    nothing_vanishes(&story, &root().join("models/effects"));
    assert_eq!(story["unexplained"].as_array().map(Vec::len), Some(1));
    let value = |effect: usize, name: &str| {
        story["effects"][effect]["parameters"][name]["value"].as_f64().expect("a number")
    };
    // 1/0.951 and 2.2, slightly biased by the remaining error.
    assert!((value(1, "flow_gain") - 1.0 / 0.951).abs() < 0.01, "{}", value(1, "flow_gain"));
    let exponent = value(2, "speed_exponent");
    assert!((exponent - 2.2).abs() < 0.05, "{exponent}");
}

#[test]
fn a_run_that_is_killed_goes_on_and_ends_with_the_same_bytes() {
    let parent = folder_with(&[]);
    let (goal, other) = (path(&parent, "found"), path(&parent, "other"));
    let args =
        |goal| ["discover", MODEL, "--data", TRAIN, "--valid", VALID, "--until", "700", "-o", goal];
    dgd(&args(&other)).done();
    killed_and_resumed(&args(&goal), &parent, "found");
    for name in ["mud_circulation.dgd", "mud_circulation.diff", "report.html", "result.json"] {
        let read = |goal: &str| read(Path::new(goal), name).replace(goal, "DIR");
        assert!(read(&goal) == read(&other), "{name} differs");
    }
    assert_eq!(listing(&parent), ["found", "other"]);
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_says_how_to_go_on_and_other_input_does_not() {
    let parent = folder_with(&[]);
    let goal = path(&parent, "found");
    let args = ["discover", MODEL, "--data", TRAIN, "-o", &goal];
    let mut child = started(&args);
    wait_until_it_minds_ctrl_c(&mut child);
    interrupt(&child);
    let run = Run::of(&child.wait_with_output().expect("it ends"));
    run.refused(130, &["the same command with `--resume` continues"]);
    assert_eq!(listing(&parent), [".found.dgd-journal"]);

    // A shorter part of the recording is another input.
    let resumed = discover(&["-o", &goal, "--until", "60", "--resume"]);
    assert!(resumed.err.contains("it belongs to another model, other data"), "{}", resumed.err);
    let resumed = discover(&["-o", &goal, "--until", "60", "--resume"]);
    assert!(resumed.err.contains("nothing to go on from"), "{}", resumed.err);
    discover(&["--resume"]).refused(2, &["`--resume`", "-o DIR"]);
}
