//! Tests the bench with requests of a page.

use std::path::PathBuf;

use dgd_data::InMemory;
use dgd_work::RunRequest;
use serde_json::{Value, json};

use crate::{ModelBench, PageRequest};

const MODEL: &str = "model cooling\n\
    parameter tau [min] = 2 in 0.1 .. 100, log  /// time constant\n\
    parameter T_0 [K] = 80 in 0 .., fixed\n\
    state T [K] = T_0\n\
    variant law {\n  newton { equation cooling: tau*der(T) = -T }\n  none { equation cooling: tau*der(T) = 0*T }\n}\n\
    output T [K] noise 0.1\n";
const EFFECT: &str = "/// Heated.\neffect heat on cooling\nkind plant\n\
    parameter P [K] = 1\nnull P = 0\nadd P to cooling\n";
const DATA: &str = "time [s],T [K]\n0,80.1\n50,53.2\n100,36.1\n200,16.0\n300,7.1\n";

fn bench() -> (ModelBench, InMemory) {
    let files = InMemory::default()
        .with_file("cooling.dgd", MODEL)
        .with_file("effects/heat.dgd", EFFECT)
        .with_file("cup.csv", DATA);
    let mut request = RunRequest::new("cooling.dgd");
    request.data = Some("cup.csv".into());
    (ModelBench::new(request), files)
}

fn asked(bench: &mut ModelBench, files: &InMemory, ask: &str) -> Value {
    let ask = PageRequest::read(ask.as_bytes()).expect("an ask");
    let answer = bench.answer(&ask, files);
    serde_json::from_str(&answer).expect("JSON")
}

/// The last number of a curve in the first panel of the first figure.
fn last(answer: &Value, curve: usize) -> f64 {
    let charts = &answer["charts"];
    let series = &charts["figures"][0]["panels"][0]["series"][curve];
    let column = series["y"].as_u64().expect("a column") as usize;
    let column = charts["columns"][column].as_array().expect("numbers");
    column.last().and_then(Value::as_f64).expect("a number")
}

#[test]
fn a_run_has_what_was_chosen_set_and_measured() {
    let (mut bench, files) = bench();
    let answer = asked(&mut bench, &files, "{}");
    assert_eq!(answer["ok"], json!(true), "{answer}");
    // 80 K exp(−300 s / 120 s).
    assert!((last(&answer, 0) - 6.566_8).abs() < 1e-3, "{}", last(&answer, 0));
    assert!((last(&answer, 1) - 7.1).abs() < 1e-9);
    let tau = &answer["controls"]["parameters"][0];
    assert_eq!(
        (&tau["name"], &tau["unit"], &tau["value"]),
        (&json!("tau"), &json!("min"), &json!(2.0))
    );
    assert_eq!((&tau["bounds"], &tau["log"]), (&json!([0.1, 100.0]), &json!(true)));
    assert_eq!(tau["writable"], json!(true));
    assert_eq!(answer["controls"]["effects"][0]["name"], json!("heat"));
    assert!(answer["agreement"].as_str().is_some_and(|table| table.contains("<table")));
    // In minutes, with the other law, and with the effect.
    let moved = asked(&mut bench, &files, r#"{"values":{"tau":4}}"#);
    assert!((last(&moved, 0) - 80.0 * (-1.25_f64).exp()).abs() < 1e-3);
    let without_law = asked(&mut bench, &files, r#"{"variant":{"law":"none"}}"#);
    assert!((last(&without_law, 0) - 80.0).abs() < 1e-3);
    let heated = asked(&mut bench, &files, r#"{"apply":["heat"],"values":{"P":3}}"#);
    assert!((last(&heated, 0) - (3.0 + 77.0 * (-2.5_f64).exp())).abs() < 1e-3);
    assert_eq!(heated["controls"]["effects"][0]["applied"], json!(true));
    let parameters = heated["controls"]["parameters"].as_array().expect("parameters");
    let effect = parameters.iter().find(|one| one["name"] == json!("P")).expect("the effect's");
    assert_eq!(effect["writable"], json!(false), "it stands in another file");
}

#[test]
fn kept_curves_stay_beside_what_follows_until_they_are_let_go() {
    let (mut bench, files) = bench();
    let kept = asked(&mut bench, &files, r#"{"do":"keep","values":{"tau":4}}"#);
    assert_eq!(kept["kept"]["what"], json!("tau = 4 min"));
    let answer = asked(&mut bench, &files, r#"{"kept":[1]}"#);
    assert!((last(&answer, 2) - 80.0 * (-1.25_f64).exp()).abs() < 1e-3);
    assert!((last(&answer, 0) - 6.566_8).abs() < 1e-3);
    let residuals = &answer["charts"]["figures"][1]["panels"][0]["series"];
    assert_eq!(residuals.as_array().map(Vec::len), Some(2));
    // They are unchanged, although the file has changed.
    let files = files.with_file("cooling.dgd", MODEL.replace("= 80", "= 40"));
    bench.forget();
    let answer = asked(&mut bench, &files, r#"{"kept":[1]}"#);
    assert!((last(&answer, 0) - 3.283_4).abs() < 1e-3);
    assert!((last(&answer, 2) - 80.0 * (-1.25_f64).exp()).abs() < 1e-3);
    for _ in 0..3 {
        assert_eq!(asked(&mut bench, &files, r#"{"do":"keep"}"#)["ok"], json!(true));
    }
    let refused = asked(&mut bench, &files, r#"{"do":"keep"}"#);
    assert!(refused["error"].as_str().is_some_and(|why| why.contains("let go")));
    let left = asked(&mut bench, &files, r#"{"do":"drop","kept":[1,2]}"#);
    assert_eq!(left["left"].as_array().map(Vec::len), Some(2));
}

#[test]
fn sensitivities_are_scaled_and_columns_are_sent_once() {
    let (mut bench, files) = bench();
    let first = asked(&mut bench, &files, "{}");
    let answer = asked(&mut bench, &files, r#"{"do":"sensitivities","values":{"tau":4}}"#);
    // tau dT/dtau = T t/tau, T after 300 s being 80 K exp(−1.25).
    let expected = 80.0 * (-1.25_f64).exp() * 1.25;
    assert!((last(&answer, 0) - expected).abs() < 1e-2, "{}", last(&answer, 0));
    let series = &answer["charts"]["figures"][0]["panels"][0]["series"];
    assert_eq!(series.as_array().map(Vec::len), Some(1), "T_0 is fixed");
    let keys = first["charts"]["keys"].to_string();
    let again = asked(&mut bench, &files, &format!("{{\"have\":{keys}}}"));
    let columns = again["charts"]["columns"].as_array().expect("columns");
    assert!(columns.iter().all(Value::is_null), "{columns:?}");
}

#[test]
fn mistakes_have_places_and_the_text_around_them() {
    let (mut bench, files) = bench();
    let files = files.with_file("cooling.dgd", MODEL.replace("-T }", "-S }"));
    let answer = asked(&mut bench, &files, "{}");
    let mistake = &answer["mistakes"][0];
    assert_eq!((&mistake["code"], &mistake["places"][0]["line"]), (&json!("E201"), &json!(6)));
    assert!(answer["texts"]["cooling.dgd"].as_str().is_some_and(|text| text.contains("-S }")));
    // The value of a parameter that no longer exists is ignored, one beyond the bounds is refused.
    let answer = asked(&mut bench, &files, r#"{"values":{"gone":1}}"#);
    assert_eq!(answer["mistakes"][0]["code"], json!("E201"));
    let files = files.with_file("cooling.dgd", MODEL);
    for act in ["run", "sensitivities", "fit"] {
        let ask = format!("{{\"do\":\"{act}\",\"values\":{{\"gone\":1}}}}");
        assert_eq!(asked(&mut bench, &files, &ask)["ok"], json!(true), "{act}");
    }
    let answer = asked(&mut bench, &files, r#"{"values":{"tau":1e9}}"#);
    assert_eq!(answer["ok"], json!(false));
}

#[test]
fn a_fit_gives_values_for_the_sliders() {
    let (mut bench, files) = bench();
    let answer = asked(&mut bench, &files, r#"{"do":"fit"}"#);
    let tau = answer["parameters"]["tau"]["value"].as_f64().expect("a value");
    assert!((tau - 124.5 / 60.0).abs() < 0.05, "{answer}");
}

#[test]
fn what_is_overtaken_says_so() {
    let (mut bench, files) = bench();
    bench.stop().stop();
    let answer = bench.answer(&PageRequest::default(), &files);
    assert_eq!(answer, r#"{"ok":false,"overtaken":true}"#);
    bench.stop().reset();
    assert_ne!(bench.answer(&PageRequest::default(), &files), answer);
    assert_eq!(bench.first()["file"], json!("cooling.dgd"));
    assert_eq!(bench.files(), [PathBuf::from("cooling.dgd"), "cup.csv".into()]);
}

#[test]
fn a_run_that_takes_hours_is_stopped_before_its_next_step() {
    let model = "model hours\nconstant w [1/s] = 1\nstate x = 1\nstate v = 0\nequation a: der(x) = v*w\nequation b: der(v) = -x*w\noutput x\n";
    let files = InMemory::default().with_file("hours.dgd", model);
    let mut request = RunRequest::new("hours.dgd");
    request.solve.until = Some(1e9);
    request.every = Some(1e8);
    let mut bench = ModelBench::new(request);
    let stop = bench.stop();
    let answer = std::thread::scope(|scope| {
        let answered = scope.spawn(|| bench.answer(&PageRequest::default(), &files));
        std::thread::sleep(std::time::Duration::from_millis(20));
        assert!(!answered.is_finished(), "it takes long");
        stop.stop();
        answered.join().expect("it ends")
    });
    assert_eq!(answer, r#"{"ok":false,"overtaken":true}"#);
}
