//! `dgd sensitivity --verify-sensitivities` on recordings where derivatives are at risk: the pump at rest
//! and the flow standing, and a valve that shuts, for flows with and without inertia.

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
const AT_REST: &str = "dgd-cli/tests/data/pump_at_rest.csv";

#[test]
fn the_pump_rests_while_the_riser_drains() {
    for flow in ["flow=dynamic", "flow=static"] {
        let (_, comparisons) = verified(CIRCULATION, AT_REST, &["--variant", flow]);
        // Two unknowns and three more outputs, to six parameters.
        assert_eq!(comparisons.len(), 30);
        all_agree(&comparisons, 61);
    }
}

#[test]
fn the_pump_rests_and_nothing_flows() {
    // At a level of 5 m the riser is as heavy as the sea above the pump: not even a static flow moves.
    let standing = ["--set", "h_r=5"];
    let (_, comparisons) = verified(CIRCULATION, AT_REST, &standing);
    all_agree(&comparisons, 61);

    // A static flow depends on its head by a root, whose slope at rest is infinite; it is said so.
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
        let data = "dgd-cli/tests/data/valve_shut.csv";
        let (_, comparisons) = verified(CIRCULATION, data, &["--variant", flow]);
        all_agree(&comparisons, 32);
    }
}

#[test]
fn a_valve_shuts_tightly_and_opens_again() {
    let (model, data) = ("dgd-cli/tests/data/valve.dgd", "dgd-cli/tests/data/valve.csv");
    for flow in ["flow=dynamic", "flow=static"] {
        let (result, comparisons) =
            verified(model, data, &["--variant", flow, "--every", "0.1", "--rtol", "1e-8"]);
        assert_eq!(result["events"].as_array().map(Vec::len), Some(2), "{result}");
        // Of 201 rows, few are passed by the valve's two transitions as their thresholds move.
        all_agree(&comparisons, 195);
    }
}
