//! Numbers on the command line that no option accepts.

use crate::support::dgd;

const MODEL: &str = "models/mud_circulation.dgd";
const DATA: &str = "examples/data/circulation.csv";

#[test]
fn numbers_that_make_no_sense_are_wrong_usage_and_the_option_is_named() {
    let above_0 = "must be a number above 0";
    let (length, moment) = ("must be a length of time", "must be a time");
    let not_below_0 = "must be 0 or a number above it";
    let count = "must be a whole number, 1 or more";
    let whole = "must be a whole number, 0 or more";
    let no = &[][..];
    let recursive = &["--estimator", "recursive"][..];
    let separable = &["--estimator", "separable"][..];
    #[allow(clippy::type_complexity, reason = "a table of cases")]
    let cases: [(&str, &[&str], &str, &[&str], &str); 26] = [
        ("simulate", no, "--rtol", &["0", "-1", "NaN", "inf", "x", "1e300", "1e-300"], above_0),
        ("sensitivity", no, "--atol", &["0", "-1", "nan", "1e300"], above_0),
        ("simulate", no, "--every", &["0", "-2", "NaN", "5 [m]"], length),
        ("simulate", no, "--from", &["NaN", "inf", "-inf", "2 lpm"], moment),
        ("fit", no, "--until", &["NaN", "inf"], moment),
        ("simulate", no, "--until", &["-1"], "the run would end at -1 s"),
        ("fit", no, "--until", &["-1"], "no sample between"),
        ("discover", no, "--until", &["-1"], "no sample between"),
        ("track", no, "--until", &["-1"], "no row between"),
        ("simulate", no, "--seed", &["-1", "0.5"], whole),
        ("simulate", no, "--noise-seed", &["-1", "0.5"], whole),
        ("simulate", no, "--threads", &["0", "-1", "18446744073709551615"], count),
        ("simulate", no, "--steps", &["per-sample=0", "per-sample=-1"], "1 or more"),
        ("fit", no, "--evaluations", &["0", "-1", "1.5", "18446744073709551615"], count),
        ("fit", no, "--starts", &["0", "-1"], "not in 1..=100000"),
        ("fit", no, "--bootstrap", &["-1", "1.5", "1e12", "1000000000000"], whole),
        ("fit", no, "--bootstrap-from", &["-1", "18446744073709551615"], whole),
        ("fit", separable, "--smoothing", &["0", "-1", "NaN"], length),
        ("fit", separable, "--steady", &["h_r=0", "h_r=-1", "h_r=NaN"], "a positive number"),
        ("fit", recursive, "--filter", &["0", "5,-1", "NaN"], above_0),
        ("fit", recursive, "--forgetting", &["-1", "NaN"], not_below_0),
        ("fit", recursive, "--start-variance", &["0", "-1"], above_0),
        ("track", no, "--gate", &["0", "-3", "NaN"], above_0),
        ("track", recursive, "--forgetting", &["0", "1.5", "NaN"], "above 0 and up to 1"),
        ("track", no, "--process-noise", &["F2=-1", "F2=NaN"], "must be a number, 0 or more"),
        ("linearize", no, "--at", &["NaN", "-5"], "--at"),
    ];
    for (command, more, option, values, part) in cases {
        for value in values {
            let args = [&[command, MODEL, "--data", DATA], more, &[option, value]].concat();
            // Fits name the recording without samples, together with `--until`.
            dgd(&args).refused(2, &[option, part]);
        }
    }
    for (option, value) in [("--start-std", "F2=0"), ("--start-std", "F2=-1"), ("--noise", "p_r=0")]
    {
        let args = ["track", MODEL, "--data", DATA, option, value];
        dgd(&args).refused(2, &[option, "must be a number, above 0"]);
    }
    for (option, value) in [("--window", "0"), ("--window", "NaN"), ("--rest", "q_boost=-1")] {
        dgd(&["screen", "--data", DATA, option, value]).refused(2, &[option]);
    }
}
