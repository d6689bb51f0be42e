//! `cargo run --release --example thesis`: each finding of the thesis comes out of the recordings, and
//! the page has all of its data figures.

#[path = "../examples/thesis/booster.rs"]
mod booster;
#[path = "../examples/thesis/chapters.rs"]
mod chapters;
#[path = "../examples/thesis/claims.rs"]
mod claims;
#[path = "../examples/thesis/curves.rs"]
mod curves;
#[path = "../examples/thesis/field.rs"]
mod field;
#[path = "../examples/thesis/flow_correction.rs"]
mod flow_correction;
#[path = "../examples/thesis/friction.rs"]
mod friction;
#[path = "../examples/thesis/html.rs"]
mod html;
#[path = "../examples/thesis/inertia.rs"]
mod inertia;
#[path = "../examples/thesis/model.rs"]
mod model;
#[path = "../examples/thesis/page.rs"]
mod page;
#[path = "../examples/thesis/pump.rs"]
mod pump;
#[path = "../examples/thesis/riser.rs"]
mod riser;
#[path = "../examples/thesis/sensitivity.rs"]
mod sensitivity;
#[path = "../examples/thesis/sensors.rs"]
mod sensors;
#[path = "../examples/thesis/verification.rs"]
mod verification;

use std::path::Path;

use booster::Booster;
use field::{A_R, BAR, Field, G, H_IN, H_OUT, LPM, RHO, slopes};
use page::Section;
use verification::Identified;

#[test]
fn the_findings_of_the_thesis_come_out_of_the_recordings() {
    let sections = chapters::all().expect("every section can be identified");
    let findings = || sections.iter().flat_map(|section| &section.findings);
    claims::verdict(&sections).expect("all of them");
    // All data figures of chapters 2, 3 and 4 and of appendix B; 3.2 and 3.13 are drawings.
    let mut numbers: Vec<String> =
        (1..=24).filter(|n| *n != 2 && *n != 13).map(|n| format!("3.{n}")).collect();
    numbers.extend(["2.3", "4.1", "4.2", "B.1"].map(String::from));
    let mut drawn: Vec<String> = findings().map(|finding| finding.number.to_owned()).collect();
    numbers.sort();
    drawn.sort();
    assert_eq!(drawn, numbers);

    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("thesis");
    html::write(&folder, &sections).expect("the folder is written");
    let index = std::fs::read_to_string(folder.join("index.html")).expect("the index");
    for number in numbers {
        let file = format!("fig_{}.svg", number.replace('.', "_"));
        assert!(index.contains(&format!("src=\"{file}\"")), "{file}");
        let svg = std::fs::read_to_string(folder.join(&file)).expect("a picture");
        assert!(svg.contains("<polyline") || svg.contains("<path"), "{file} is empty");
    }
    // The one that the README shows.
    let [drawn, shown] = [folder.join("fig_4_2.svg"), root.join("docs/fig_4_2.svg")]
        .map(|path| std::fs::read(path).expect("a picture"));
    assert!(
        drawn == shown,
        "`cargo run --release --example thesis` draws another docs/fig_4_2.svg"
    );
}

/// The figures of a section of which something does not come out.
fn lost(section: &Section) -> Vec<&'static str> {
    let is_lost = |finding: &&page::Finding| finding.claims.iter().any(|claim| !claim.holds);
    section.findings.iter().filter(is_lost).map(|finding| finding.number).collect()
}

/// Fails unless these figures claim something that does not come out.
fn assert_lost(what: &str, section: &Section, figures: &[&str]) {
    let lost = lost(section);
    for figure in figures {
        assert!(lost.contains(figure), "{what}: Fig {figure} claims what it has lost; {lost:?}");
    }
}

/// Deterministic noise of some pascals, as a sensor has it.
fn noise(k: usize) -> f64 {
    ((k * 7919) % 101) as f64 * 20.0 - 1000.0
}

#[test]
fn a_claim_that_does_not_hold_fails_the_example_and_is_marked() {
    let mut section = curves::draw(&[]).expect("the model's curves");
    let holds = |section: Section| {
        let page = html::index(std::slice::from_ref(&section)).expect("a page");
        (claims::verdict(&[section]), page)
    };
    let (verdict, page) = holds(curves::draw(&[]).expect("the model's curves"));
    assert!(verdict.is_ok() && page.contains("all of them hold"), "{verdict:?}");
    assert!(!page.contains("does not hold"));
    section.findings[0].claims[1].holds = false;
    let what = section.findings[0].claims[1].what;
    let (verdict, page) = holds(section);
    let message = verdict.expect_err("a claim does not hold");
    assert!(message.contains("Fig 2.3") && message.contains(what), "{message}");
    assert!(page.contains("does not hold") && !page.contains("all of them hold"));
    // Nor may a figure say nothing.
    let mut section = curves::draw(&[]).expect("the model's curves");
    section.findings[0].claims.clear();
    assert!(claims::verdict(&[section]).expect_err("nothing").contains("nothing is claimed"));
}

#[test]
fn findings_of_models_are_noticed_when_they_are_lost() {
    let straight = curves::draw(&[("pump.c2", 0.0)]).expect("curves");
    assert_lost("a pump without losses", &straight, &["2.3"]);
    for (what, settings) in [("a heavier line", ("M", 1.1e10)), ("a weaker pump", ("c0", 0.2))] {
        let section = sensitivity::draw(&[settings]).expect("sensitivities");
        assert_lost(what, &section, &["3.1"]);
    }
}

#[test]
fn findings_of_pressures_and_flows_are_noticed_when_they_are_lost() {
    let read = |name: &str| Field::read(name).expect("a recording");
    let (no_flow, circulation) = (read("no_flow"), read("normal_circulation"));
    let right = no_flow.changed("p_in_B", |_, p| p - 0.5 * BAR);
    assert_lost("a right inlet B", &sensors::screen(&right), &["3.3"]);
    let one = no_flow.changed("p_out_A", |_, p| p + 0.1 * BAR);
    assert_lost("another outlet A", &sensors::screen(&one), &["3.4"]);

    let right = circulation.changed("q_ssp", |_, q| 0.951 * q);
    let (section, _) = flow_correction::identify(&right).expect("a correction");
    assert_lost("a right flow meter", &section, &["3.11", "3.12"]);

    let tests = read("pump_tests");
    let slow = tests.changed("q_ssp", |k, _| (1000.0 + 0.35 * k as f64) * LPM);
    let (section, _) = friction::identify(&slow).expect("friction");
    assert_lost("a flow without transients", &section, &["3.5", "3.6"]);
    // Behind the pump whatever makes the friction grow with the flow and not with its square.
    let (q, inlet) = (tests.column("q_ssp"), tests.column("p_in_A"));
    let weight = RHO * G * (H_OUT - H_IN);
    let behind =
        |k: usize| inlet[k] + weight + RHO * G * tests.level()[0] + 1.5e7 * q[k] + noise(k);
    let level = tests.level();
    let linear = |k: usize, _: f64| behind(k) + RHO * G * (level[k] - level[0]);
    let linear = tests.changed("p_out_A", linear).changed("p_out_B", linear);
    let (section, _) = friction::identify(&linear).expect("friction");
    assert_lost("friction of laminar flow", &section, &["3.6", "3.7"]);
}

#[test]
fn findings_of_the_pump_are_noticed_when_they_are_lost() {
    let read = |name: &str| Field::read(name).expect("a recording");
    let (tests, circulation) = (read("pump_tests"), read("normal_circulation"));
    let (_, friction) = friction::identify(&tests).expect("friction");
    let (w, q, inlet) = (tests.column("w_ssp"), tests.column("q_ssp"), tests.column("p_in_A"));
    let affine = |k: usize, _: f64| {
        inlet[k]
            + RHO * G * (300.0 * w[k].powi(2) - 500.0 * w[k] * q[k] - 8000.0 * q[k].powi(2))
            + noise(k)
    };
    let square = tests.changed("p_out_A", affine).changed("p_out_B", affine);
    let (section, _) = pump::identify(&square, &circulation, &friction).expect("a pump");
    assert_lost("a pump with an exponent of 2", &section, &["3.8", "3.9"]);
    // What the filter drops is read wrong, so that the filtered pump is the better one.
    let wrong = |k: usize, p: f64| if w[k] > 0.65 { p + 1.0 * BAR } else { p };
    let wrong = tests.changed("p_out_A", wrong).changed("p_out_B", wrong);
    let (section, _) = pump::identify(&wrong, &circulation, &friction).expect("a pump");
    assert_lost("a pump that is read wrong at high speed", &section, &["3.10", "3.24"]);
}

#[test]
fn findings_of_u_tubing_and_inertia_are_noticed_when_they_are_lost() {
    let read = |name: &str| Field::read(name).expect("a recording");
    let (ramps, restarts) = (read("booster_ramps"), read("booster_restarts"));
    let (tests, circulation) = (read("pump_tests"), read("normal_circulation"));
    let (_, friction) = friction::identify(&tests).expect("friction");
    let (_, pump) = pump::identify(&tests, &circulation, &friction).expect("a pump");
    let (_, booster) = booster::identify(&restarts, 0.951).expect("a booster line");

    // The calculated flow is what the level says.
    let rise = slopes(&restarts.times, &restarts.level(), 10);
    let (q, fill) = (restarts.column("q_ssp"), restarts.column("q_tf"));
    let counted = restarts.changed("q_boost", |k, _| 0.951 * q[k] - fill[k] - A_R * rise[k]);
    let (section, _) = booster::identify(&counted, 0.951).expect("a booster line");
    assert_lost("all is counted", &section, &["3.14", "3.15", "3.16", "3.17", "3.18", "3.19"]);

    // A meter that lags by half a minute.
    let read = ramps.column("q_ssp");
    let mut lagged = read.to_vec();
    for k in 1..lagged.len() {
        lagged[k] = lagged[k - 1] + (read[k] - lagged[k - 1]) / 30.0;
    }
    let slow = ramps.changed("q_ssp", |k, _| lagged[k]);
    let (section, inertia) = inertia::identify(&slow, &friction, &pump).expect("an inertia");
    assert_lost("a meter that lags", &section, &["3.21", "3.22"]);
    let deep = ramps.changed("p_in_A", |k, p| p + 2.0 * BAR * (k as f64 / 500.0).sin());
    let (section, _) = inertia::identify(&deep, &friction, &pump).expect("an inertia");
    assert_lost("a level that varies", &section, &["3.20"]);

    let identified = |theta_1: f64, booster: Booster, inertia: f64| Identified {
        friction,
        pump,
        theta_1,
        booster,
        inertia,
    };
    let drawn = |of: &Identified, restarts: &Field| {
        verification::draw(&circulation, restarts, of).expect("both cases")
    };
    let heavy = drawn(&identified(0.951, booster, 20.0 * inertia), &restarts);
    assert_lost("a heavy return line", &heavy, &["3.23"]);
    assert_lost("no correction", &drawn(&identified(1.0, booster, 5e7), &restarts), &["4.1"]);
    let late = Booster { tau_d: 120.0, ..booster };
    assert_lost("a late booster", &drawn(&identified(0.951, late, 5e7), &restarts), &["4.2"]);
    assert_lost("all is counted", &drawn(&identified(0.951, booster, 5e7), &counted), &["B.1"]);
}
