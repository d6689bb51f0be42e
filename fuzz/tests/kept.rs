//! Runs all oracles on models that have failed before.

use std::path::Path;

use dgd_fuzz::case::Case;
use dgd_fuzz::oracle::{judged, keep_panics};

#[test]
fn kept_models_hold() {
    keep_panics();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("kept");
    let mut paths: Vec<_> = std::fs::read_dir(&folder)
        .expect("the folder of kept models")
        .map(|entry| entry.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "dgd"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "{}", folder.display());
    for path in paths {
        let case = Case::read(&path).expect("a readable model");
        let findings = judged(&case, &[]);
        assert!(findings.is_empty(), "{}: {findings:#?}", path.display());
    }
}

/// A seed always gives the same model, whatever was generated before.
#[test]
fn models_follow_from_their_seeds() {
    let first: Vec<Case> = (0..20).map(|seed| dgd_fuzz::grammar::case(seed, &[])).collect();
    for (seed, case) in first.iter().enumerate().rev() {
        assert_eq!(dgd_fuzz::grammar::case(seed as u64, &[]), *case);
    }
}

/// Every form of the table is used by some seed.
#[test]
fn every_row_of_the_table_is_used() {
    let models: String = (0..3000).map(|seed| dgd_fuzz::grammar::case(seed, &[]).model).collect();
    for form in [
        "constant ",
        "parameter ",
        "input ",
        "state ",
        "unknown ",
        "let ",
        "function ",
        "equation ",
        "output ",
        "variant ",
        "modes ",
        "when ",
        "saturate ",
        "size ",
        "for i in",
        "import ",
        "part ",
        " hold",
        " linear",
        " log",
        " fixed",
        "nominal ",
        "prior normal",
        "in 0 ..",
        "noise ",
        "history ",
        "reset ",
        "start b if",
        "rises above",
        "falls below",
        "delay(",
        "///",
        "# A remark",
    ] {
        assert!(models.contains(form), "{form}");
    }
    for function in dgd_compiler::expr::intrinsics::INTRINSICS {
        assert!(models.contains(&format!("{}(", function.name)), "{}", function.name);
    }
}
