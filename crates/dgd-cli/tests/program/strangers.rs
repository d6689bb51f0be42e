//! Data and names that are malicious, or were made by other programs.

use std::fmt::Write as _;
use std::fs;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::{dgd, dgd_in, folder_with, piped};

const TANK: &str = "\
model tank
input q [lpm] hold
parameter a [cm^2] = 10  in 0.1 .. 100, log
state h [m] = 1
equation level: 1 [m^2]*der(h) = q - a*sqrt(2*9.81 [m/s^2]*h)
output h [m]  noise 1 [cm]
";

/// Rows with one of each kind that cannot be read.
const BROKEN: &str = "\
time [s],q [lpm],h [m]
0,300,1
5,300,1.003
10,300
12,three,1
14,\"300,1
20,300,1.01
15,300,1.01
later,300,1.01
25,300,1.013
30,300,1.016,4
35,300,1.02
";

#[test]
fn rows_that_cannot_be_read_are_left_out_with_their_lines() {
    let folder = folder_with(&[("t.dgd", TANK.as_bytes()), ("b.csv", BROKEN.as_bytes())]);
    let streamed =
        piped(folder.path(), &["track", "t.dgd", "--data", "-"], BROKEN.as_bytes()).done();
    let of_file = dgd_in(folder.path(), &["track", "t.dgd", "--data", "b.csv"]).done();
    assert_eq!(streamed.out, of_file.out);
    let times = crate::support::column(&of_file.out, "time [s]");
    assert_eq!(times, [0.0, 5.0, 20.0, 25.0, 35.0]);
    for (name, run) in [("standard input", &streamed), ("b.csv", &of_file)] {
        for (line, what) in [
            (4, "this row has 2 cells, and the header 3"),
            (5, "`three` in column `q` is not a number"),
            (6, "a quoted cell is not closed"),
            (8, "the time goes back, from 20 s to 15 s"),
            (9, "`later` is neither a number nor an ISO 8601 stamp"),
            (11, "this row has 4 cells"),
        ] {
            let text = format!("{name}, line {line}: {what}");
            assert!(run.err.contains(&text), "no {text:?} in\n{}", run.err);
        }
        assert!(run.err.contains("could not be read, left out: 6"), "{}", run.err);
    }
    // Programs get the report with the result.
    let args = ["track", "t.dgd", "--data", "-", "--format", "json", "--quiet"];
    let run = piped(folder.path(), &args, BROKEN.as_bytes()).done();
    let lines: Vec<Value> =
        run.out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let left_out = lines.iter().filter_map(|line| line["left_out"]["line"].as_u64());
    assert_eq!(left_out.collect::<Vec<_>>(), [4, 5, 6, 8, 9, 11]);
    assert_eq!(run.err, "");
}

#[test]
fn strict_stops_at_a_row_that_cannot_be_read() {
    let folder = folder_with(&[("t.dgd", TANK.as_bytes()), ("b.csv", BROKEN.as_bytes())]);
    let args = ["track", "t.dgd", "--data", "-", "--strict"];
    let run = piped(folder.path(), &args, BROKEN.as_bytes());
    run.refused(1, &["standard input, line 4: this row has 2 cells"]);
    assert_eq!(run.out.lines().count(), 3);
    let run = dgd_in(folder.path(), &["track", "t.dgd", "--data", "b.csv", "--strict"]);
    run.refused(1, &["b.csv:4"]);
    assert_eq!(run.out, "", "a file is read whole before anything is computed");
}

#[test]
fn a_stream_without_lines_is_given_up() {
    let folder = folder_with(&[("t.dgd", TANK.as_bytes())]);
    let args = ["track", "t.dgd", "--data", "-"];
    let mut endless = b"time [s],q [lpm],h [m]\n0,300,1\n5,".to_vec();
    endless.resize(17 << 20, b'3');
    piped(folder.path(), &args, &endless).refused(1, &["line 3", "more than 16 MB"]);
    piped(folder.path(), &args, vec![b'#'; 17 << 20]).refused(1, &["no header line"]);
}

#[test]
fn other_encodings_are_named_with_what_converts_them() {
    let utf_16 = |text: &str| -> Vec<u8> {
        [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    };
    let data = "time [s],q [lpm],h [m]\n0,300,1\n5,300,1\n";
    let (data_16, model_16) = (utf_16(data), utf_16(TANK));
    let folder = folder_with(&[
        ("t.dgd", TANK.as_bytes()),
        ("u.dgd", &model_16),
        ("u.csv", &data_16),
        ("bare.csv", &data_16[2..]),
        ("latin.csv", b"time [s],q [lpm],\xb0\n0,300,1\n"),
    ]);
    let run = |args: &[&str]| dgd_in(folder.path(), args);
    let how = "iconv -f UTF-16";
    run(&["simulate", "t.dgd", "--data", "u.csv"]).refused(1, &["its text is UTF-16", how]);
    run(&["simulate", "t.dgd", "--data", "bare.csv"]).refused(1, &["its text is UTF-16", how]);
    run(&["check", "u.dgd"]).refused(1, &["its text is UTF-16", how]);
    let args = ["track", "t.dgd", "--data", "-"];
    piped(folder.path(), &args, &data_16).refused(1, &["its text is UTF-16", how]);
    for args in [&["simulate"][..], &["track"]] {
        run(&[args, &["t.dgd", "--data", "latin.csv"]].concat()).refused(1, &["UTF-8"]);
    }
}

#[test]
fn thousands_of_columns_that_nobody_asks_for_are_a_short_note() {
    const COLUMNS: usize = 20_000;
    let mut data = "time [s],q [lpm],h [m]".to_owned();
    (0..COLUMNS).for_each(|k| write!(data, ",tag_{k:05} [bar]").expect("to a string"));
    for row in 0..3 {
        write!(data, "\n{row},300,1").expect("to a string");
        (0..COLUMNS).for_each(|_| data.push_str(",2"));
    }
    let folder = folder_with(&[("t.dgd", TANK.as_bytes()), ("wide.csv", data.as_bytes())]);
    let began = Instant::now();
    for command in ["simulate", "track"] {
        let run = dgd_in(folder.path(), &[command, "t.dgd", "--data", "wide.csv"]).done();
        assert!(
            run.err.contains("`tag_00000`") && run.err.contains("and 19992 more"),
            "{}",
            run.err
        );
        assert!(run.err.len() < 4000, "{} bytes", run.err.len());
    }
    assert!(began.elapsed() < Duration::from_secs(20), "{:?}", began.elapsed());
}

#[test]
fn nothing_that_is_said_is_obeyed_by_a_terminal() {
    let model = TANK.replace("input q", "input q_in").replace("= q -", "= q_in -");
    let folder = folder_with(&[
        ("t.dgd", model.as_bytes()),
        ("d.csv", "time [s],q_i\u{202e}n [lpm],\u{1b}[2Jx\n0,300,1\n5,300,2\n".as_bytes()),
    ]);
    let misleads = |text: &str| {
        let obeyed = |c: char| {
            (c.is_control() && c != '\n' && c != '\t') || ('\u{202a}'..='\u{202e}').contains(&c)
        };
        text.contains(obeyed)
    };
    let run = dgd_in(folder.path(), &["simulate", "t.dgd", "--data", "d.csv"]);
    run.refused(1, &["q_i\\u{202e}n"]);
    assert!(!misleads(&run.err), "{:?}", run.err);
    let run = dgd_in(folder.path(), &["screen", "--data", "d.csv"]);
    assert!(!misleads(&run.err) && !misleads(&run.out), "{:?}{:?}", run.err, run.out);
    let run = dgd_in(folder.path(), &["check", "\u{202e}none.dgd"]);
    run.refused(1, &["\\u{202e}none.dgd"]);
    let run = dgd_in(folder.path(), &["check", "t.dgd", "--\u{202e}gpj"]);
    run.refused(2, &["\\u{202e}gpj"]);
    assert!(!misleads(&run.err), "{:?}", run.err);
}

#[test]
fn an_empty_file_is_said_to_be_empty() {
    let folder = folder_with(&[("t.dgd", TANK.as_bytes()), ("empty", b"")]);
    dgd_in(folder.path(), &["simulate", "t.dgd", "--data", "empty"]).refused(1, &["it is empty"]);
    dgd_in(folder.path(), &["track", "t.dgd", "--data", "empty"]).refused(1, &["it is empty"]);
    assert!(fs::read(folder.path().join("empty")).is_ok_and(|bytes| bytes.is_empty()));
}

#[test]
fn a_column_that_the_model_knows_is_not_taken_for_a_misspelt_one() {
    // `q_ssp`, which exists for an output, is as similar to `w_ssp`.
    let rows = "time [s],w_sp [%],q_boost [lpm],q_tf [lpm],q_ssp [lpm]\n0,50,1850,290,2140\n";
    let folder = folder_with(&[("run.csv", rows.as_bytes())]);
    let data = folder.path().join("run.csv").display().to_string();
    dgd(&["simulate", "models/mud_circulation.dgd", "--data", &data])
        .refused(1, &["E603", "is the column `w_sp` meant to be `w_ssp`?"]);
}

#[test]
fn work_that_takes_no_standard_deviations_from_the_data_says_so() {
    let mut rows = "time [s],q [lpm],h [m],std(h) [cm]\n".to_owned();
    for k in 0..40 {
        let _ = writeln!(rows, "{},300,1.0{},2", 5 * k, 7 * k % 10);
    }
    let folder = folder_with(&[("t.dgd", TANK.as_bytes()), ("run.csv", rows.as_bytes())]);
    for (command, uses_it) in [("discover", true), ("track", false)] {
        let run = dgd_in(folder.path(), &[command, "t.dgd", "--data", "run.csv"]).done();
        let is_left_out = run.err.contains("the column `std(h)` is not used");
        assert_ne!(is_left_out, uses_it, "{command}: {}", run.err);
    }
}
