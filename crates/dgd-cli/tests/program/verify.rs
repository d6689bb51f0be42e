//! `dgd sensitivity --verify-sensitivities` on recordings with critical derivatives: a stopped pump with stagnant flow,
//! and a valve that shuts, for flows with and without inertia.

use serde_json::Value;

use crate::support::dgd;

/// Verifies the sensitivities of a run; every comparison by (of, to).
#[track_caller]
fn verified(model: &str, data: &str, more: &[&str]) -> (Value, Vec<Value>) {
    let args = ["sensitivity", model, "--data", data, "--verify-sensitivities", "--format", "json"];
    let run = dgd(&[&args, more].concat()).done();
    let result = run.json();
    let comparisons = result["verification"]["sensitivities"].as_array().cloned();
    (result, comparisons.expect("a list"))
}

#[track_caller]
fn all_agree(comparisons: &[Value], samples: u64) {
    for comparison in comparisons {
        assert_eq!(comparison["agrees"], true, "{comparison}");
        let counts = &comparison["samples"];
        assert_eq!(counts["undefined"], 0, "{comparison}");
        let count = |name: &str| counts[name].as_u64().expect("a count");
        assert!(count("compared") >= samples, "{comparison}");
    }
}

const CIRCULATION: &str = "models/mud_circulation.dgd";
const AT_REST: &str = "crates/dgd-cli/tests/data/pump_at_rest.csv";

#[test]
fn the_pump_rests_while_the_riser_drains() {
    for flow in ["flow=dynamic", "flow=static"] {
        let (_, comparisons) = verified(CIRCULATION, AT_REST, &["--variant", flow]);
        // Two unknowns and three more outputs, with respect to six parameters.
        assert_eq!(comparisons.len(), 30);
        all_agree(&comparisons, 61);
    }
}

#[test]
fn the_pump_rests_and_nothing_flows() {
    // At a level of 5 m the riser balances the sea above the pump: not even a static flow moves.
    let standing = ["--set", "h_r=5"];
    let (_, comparisons) = verified(CIRCULATION, AT_REST, &standing);
    all_agree(&comparisons, 61);

    // A static flow is a root of its head, with an infinite slope at zero, which is reported.
    let fixed = [&standing[..], &["--variant", "flow=static"]].concat();
    let (result, comparisons) = verified(CIRCULATION, AT_REST, &fixed);
    assert_eq!(result["undefined"][0]["equation"], "return_line");
    for comparison in &comparisons {
        assert!(comparison["agrees"].is_null(), "{comparison}");
        assert_eq!(comparison["samples"]["undefined"], 61, "{comparison}");
    }
}

#[test]
fn a_valve_in_the_supply_shuts_within_half_a_second() {
    for flow in ["flow=dynamic", "flow=static"] {
        let data = "crates/dgd-cli/tests/data/valve_shut.csv";
        let (_, comparisons) = verified(CIRCULATION, data, &["--variant", flow]);
        all_agree(&comparisons, 32);
    }
}

#[test]
fn a_valve_shuts_tightly_and_opens_again() {
    let (model, data) =
        ("crates/dgd-cli/tests/data/valve.dgd", "crates/dgd-cli/tests/data/valve.csv");
    for flow in ["flow=dynamic", "flow=static"] {
        let (result, comparisons) =
            verified(model, data, &["--variant", flow, "--every", "0.1", "--rtol", "1e-8"]);
        assert_eq!(result["events"].as_array().map(Vec::len), Some(2), "{result}");
        // The valve's two transitions pass only a few of 201 rows as their thresholds move.
        all_agree(&comparisons, 195);
    }
}

#[test]
fn derivatives_of_the_whole_well_are_not_cried_wolf_over() {
    let (model, data) = ("models/dual_gradient_drilling.dgd", "examples/data/pipe_connection.csv");
    let args = ["--of", "string.x", "--to", "control.gain", "--every", "5", "--rtol", "1e-8"];
    let (_, comparisons) = verified(model, data, &args);
    // Only the requested sensitivity is compared.
    assert_eq!(comparisons.len(), 1, "{comparisons:?}");
    all_agree(&comparisons, 300);
    // The mass of mud is conserved, so its derivatives are zero up to rounding.
    let (_, comparisons) = verified(model, data, &[&["--of", "mud"], &args[2..]].concat());
    assert_ne!(comparisons[0]["agrees"], false, "{comparisons:?}");
}

#[test]
fn derivatives_that_are_zero_but_for_rounding_are_not_wrong() {
    let (model, data) = ("models/lines_of_the_well.dgd", "examples/data/lines_of_the_well.csv");
    let (_, comparisons) = verified(model, data, &["--to", "string.eps"]);
    for comparison in &comparisons {
        assert_ne!(comparison["agrees"], false, "{comparison}");
    }
    let agree = comparisons.iter().filter(|comparison| comparison["agrees"] == true).count();
    assert!(agree > comparisons.len() / 2, "{agree} of {}", comparisons.len());
}
