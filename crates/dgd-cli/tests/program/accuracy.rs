//! The command line against independent solutions, with `--rtol 1e-8`.

use std::path::{Path, PathBuf};
use std::process::Command;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::SourceMap;
use dgd_data::{DataTable, read};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn table(path: &Path) -> DataTable {
    read(path, &mut SourceMap::default(), &mut Diagnostics::default()).expect("a table")
}

/// SI value of one column unit.
fn factor(unit: Option<&dgd_compiler::units::Unit>) -> f64 {
    unit.map_or(1.0, |unit| unit.factor)
}

fn check(model: &str, flow: &str, inputs: &str, reference: &str, every: Option<&str>) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("sensitivities.csv");
    let states = folder.path().join("states.csv");
    for (command, out) in [("sensitivity", &out), ("simulate", &states)] {
        let mut dgd = Command::new(env!("CARGO_BIN_EXE_dgd"));
        dgd.current_dir(root()).args([command, model, "--data", inputs, "--rtol", "1e-8"]);
        dgd.args(["--variant", &format!("flow={flow}"), "-o"]).arg(out);
        dgd.args(every.map(|dt| ["--every", dt]).into_iter().flatten());
        let run = dgd.output().expect("the program runs");
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    }

    let reference = table(&root().join(reference));
    let (sensitivities, states) = (table(&out), table(&states));
    assert_eq!(reference.time, sensitivities.time);
    for column in &reference.columns {
        let result = sensitivities.column(&column.name).or_else(|| states.column(&column.name));
        let result = result.unwrap_or_else(|| panic!("no column `{}`", column.name));
        let si = factor(result.unit.as_ref());
        let largest = column.values.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        for (value, expected) in result.values.iter().zip(&column.values) {
            let error = (value * si - expected).abs() / largest;
            assert!(error <= 1e-6, "{model} {flow} `{}`: off by {error:.1e}", column.name);
        }
    }
}

#[test]
fn level_and_sensitivities_are_right_to_1e_6() {
    for flow in ["dynamic", "static"] {
        check(
            "models/mud_circulation.dgd",
            flow,
            "tests/reference/mud_circulation_inputs.csv",
            &format!("tests/reference/mud_circulation_{flow}.csv"),
            None,
        );
        check(
            "models/pump_speed_step.dgd",
            flow,
            "examples/data/pump_speed_step.csv",
            &format!("tests/reference/pump_speed_step_{flow}.csv"),
            Some("1"),
        );
    }
}
