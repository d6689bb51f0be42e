//! Input and output files: no input is replaced, no output is left incomplete, and only files are opened.

use std::fs;
use std::path::Path;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::SourceMap;
use dgd_data as data;
use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Run, command, dgd_in, folder_with, listing};

const TANK: &str = "\
model tank
input q [lpm] hold
parameter a [cm^2] = 10  in 0.1 .. 100, log
state h [m] = 1
equation level: 1 [m^2]*der(h) = q - a*sqrt(2*9.81 [m/s^2]*h)
output h [m]  noise 1 [cm]
";

const DATA: &str = "time [s],q [lpm],h [m]\n0,300,1\n5,300,1.003\n10,300,1.006\n15,300,1.01\n";

fn folder() -> TempDir {
    let library = b"let g_0 = 9.81 [m/s^2]\n";
    let with_import = TANK.replace("model tank\n", "model tank\nimport \"g.dgd\"\n");
    folder_with(&[
        ("t.dgd", TANK.as_bytes()),
        ("i.dgd", with_import.as_bytes()),
        ("g.dgd", library),
        ("d.csv", DATA.as_bytes()),
        ("s.csv", b"a [cm^2]\n10\n12\n"),
    ])
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Runs a command that must end within seconds.
#[cfg(unix)]
fn at_once(folder: &Path, args: &[&str]) -> Run {
    use std::time::{Duration, Instant};
    let mut command = command(folder, args);
    command.stdin(std::process::Stdio::null());
    command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
    let mut child = command.spawn().expect("the command starts");
    let until = Instant::now() + Duration::from_mins(1);
    while child.try_wait().expect("a child").is_none() {
        if Instant::now() > until {
            child.kill().expect("it is under way");
            panic!("{args:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Run::of(&child.wait_with_output().expect("it has ended"))
}

#[test]
fn no_result_takes_the_place_of_what_is_read() {
    let folder = folder();
    fs::create_dir(folder.path().join("sub")).expect("the folder is writable");
    let before = (listing(&folder), read(&folder, "t.dgd"), read(&folder, "d.csv"));
    let run = ["--data", "d.csv"];
    let cases: [(&[&str], &str); 9] = [
        (&["simulate", "t.dgd"], "t.dgd"),
        (&["simulate", "t.dgd"], "d.csv"),
        (&["simulate", "t.dgd"], "sub/../d.csv"),
        (&["simulate", "t.dgd", "--ensemble", "s.csv"], "s.csv"),
        (&["sensitivity", "t.dgd"], "./d.csv"),
        (&["linearize", "t.dgd", "--at", "steady"], "d.csv"),
        (&["track", "t.dgd"], "d.csv"),
        (&["fit", "t.dgd"], "."),
        (&["discover", "t.dgd"], "sub/.."),
    ];
    for (args, out) in cases {
        let all_args = [args, &run[..], &["-o", out]].concat();
        dgd_in(folder.path(), &all_args).refused(2, &["would replace", "which this command reads"]);
    }
    // A run that ends early would write there.
    fs::write(folder.path().join("r.partial.csv"), DATA).expect("the folder is writable");
    let args = ["simulate", "t.dgd", "--data", "r.partial.csv", "-o", "r.csv"];
    dgd_in(folder.path(), &args).refused(2, &["would replace `r.partial.csv`"]);
    fs::remove_file(folder.path().join("r.partial.csv")).expect("it is there");
    for args in [&["emit", "i.dgd", "--stage", "dae"][..], &["check", "i.dgd"]] {
        let all_args = [args, &["-o", "g.dgd"]].concat();
        dgd_in(folder.path(), &all_args).refused(2, &["would replace"]);
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("d.csv", folder.path().join("link.csv")).expect("writable");
        fs::hard_link(folder.path().join("d.csv"), folder.path().join("hard.csv"))
            .expect("writable");
        for out in ["link.csv", "hard.csv"] {
            let args = ["simulate", "t.dgd", "--data", "d.csv", "-o", out];
            dgd_in(folder.path(), &args).refused(2, &["would replace `d.csv`"]);
            fs::remove_file(folder.path().join(out)).expect("it is there");
        }
        // Imports are known once the model has been read.
        fs::hard_link(folder.path().join("g.dgd"), folder.path().join("g.csv")).expect("writable");
        for command in ["simulate", "sensitivity", "track"] {
            let args = [command, "i.dgd", "--data", "d.csv", "-o", "g.csv"];
            dgd_in(folder.path(), &args).refused(2, &["would replace `g.dgd`"]);
        }
        fs::remove_file(folder.path().join("g.csv")).expect("it is there");
        // Standard input may be a file.
        let mut track = command(folder.path(), &["track", "t.dgd", "--data", "-", "-o", "d.csv"]);
        track.stdin(fs::File::open(folder.path().join("d.csv")).expect("it is there"));
        if Path::new("/dev/stdin").exists() {
            let run = Run::of(&track.output().expect("the command starts"));
            run.refused(2, &["would replace"]);
        }
    }
    assert_eq!((listing(&folder), read(&folder, "t.dgd"), read(&folder, "d.csv")), before);
}

#[test]
fn a_place_that_cannot_be_written_is_known_before_anything_is_computed() {
    let folder = folder();
    // A run that would take a while, with more rows than anyone could wait for.
    let long = ["simulate", "t.dgd", "--data", "d.csv", "--every", "1e-6"];
    let refused = |more: &[&str], code: i32, part: &str| {
        dgd_in(folder.path(), &[&long[..], more].concat()).refused(code, &[part]);
    };
    refused(&["-o", "none/run.csv"], 1, "the folder `none` does not exist");
    refused(&["-o", "."], 1, "it is a folder");
    refused(&["--plot", "none/a.svg"], 1, "the folder `none` does not exist");
    refused(&["--plot", "a.svg", "-o", "a.xlsx"], 2, "not as .xlsx");
    refused(&["--plot", "a.svg", "-o", "./a.svg"], 2, "not as .svg");
    let fit = ["fit", "t.dgd", "--data", "d.csv", "-o"];
    let into = |out| dgd_in(folder.path(), &[&fit[..], &[out]].concat());
    into("none/fitted").refused(1, &["the folder `none` does not exist"]);
    into("d.csv").refused(1, &["cannot write into `d.csv`: it is not a folder"]);
    assert_eq!(listing(&folder), ["d.csv", "g.dgd", "i.dgd", "s.csv", "t.dgd"]);
}

/// Commands whose result is a table.
const TABLES: [&[&str]; 4] = [
    &["simulate", "t.dgd"],
    &["sensitivity", "t.dgd"],
    &["simulate", "t.dgd", "--ensemble", "s.csv"],
    &["linearize", "t.dgd", "--at", "steady"],
];

#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_holds_what_the_csv_does() {
    let folder = folder();
    let run = |args: &[&str]| dgd_in(folder.path(), args).done();
    let data = ["--data", "d.csv"];
    // Read again, it gives the same run to the last digit.
    for command in &TABLES[..2] {
        run(&[*command, &data, &["-o", "t.csv"]].concat());
        run(&[*command, &data, &["-o", "t.parquet"]].concat());
        assert!(
            fs::read(folder.path().join("t.parquet")).is_ok_and(|file| file.starts_with(b"PAR1"))
        );
        let table = |name: &str| {
            let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
            let read = data::read(&folder.path().join(name), &mut sources, &mut diagnostics);
            let table = read.expect("a table");
            let columns = table.columns.iter();
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            let columns: Vec<_> =
                columns.map(|c| (c.name.clone(), c.unit.clone(), bits(&c.values))).collect();
            (table.time, format!("{columns:?}"))
        };
        assert_eq!(table("t.parquet"), table("t.csv"));
    }
    run(&["simulate", "t.dgd", "--data", "d.csv", "-o", "t.parquet"]);
    let again = run(&["simulate", "t.dgd", "--data", "t.parquet"]).out;
    assert_eq!(again, run(&["simulate", "t.dgd", "--data", "d.csv"]).out);
    for command in [TABLES[2], TABLES[3], &["track", "t.dgd"]] {
        run(&[command, &data, &["-o", "t.parquet"]].concat());
        assert!(
            fs::read(folder.path().join("t.parquet")).is_ok_and(|file| file.ends_with(b"PAR1"))
        );
    }
}

#[cfg(not(feature = "parquet"))]
#[test]
fn a_build_without_parquet_says_how_to_get_it() {
    let folder = folder();
    let write = ["simulate", "t.dgd", "--data", "d.csv", "-o", "t.parquet"];
    dgd_in(folder.path(), &write).refused(2, &["does not write Parquet", "--features parquet"]);
    fs::write(folder.path().join("t.parquet"), b"PAR1 a table PAR1").expect("writable");
    let read = ["simulate", "t.dgd", "--data", "t.parquet"];
    dgd_in(folder.path(), &read).refused(1, &["does not read", "feature `parquet`"]);
}

#[test]
fn a_file_holds_what_its_name_says() {
    let folder = folder();
    let run = |args: &[&str]| dgd_in(folder.path(), args).done();
    let json = |name: &str| -> Value {
        serde_json::from_str(&read(&folder, name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let data = ["--data", "d.csv"];
    for command in TABLES {
        for (out, format) in [("t.json", "text"), ("t.json", "json"), ("plain", "json")] {
            let args = [command, &data, &["-o", out, "--format", format]].concat();
            assert_eq!(run(&args).out, "", "{args:?}");
            let written = json(out);
            let printed = run(&[command, &data, &["--format", "json"]].concat()).json();
            assert_eq!(written, printed, "{args:?}");
        }
        // A program gets the rest of the result, which the table does not hold.
        let args = [command, &data, &["-o", "t.csv", "--format", "json"]].concat();
        assert!(run(&args).json().is_object());
        assert!(read(&folder, "t.csv").lines().next().is_some_and(|line| line.contains(',')));
    }
    // A result that is not a table cannot be written as one.
    let emit = ["emit", "t.dgd", "--stage", "rust", "-o", "t.parquet"];
    dgd_in(folder.path(), &emit).refused(2, &["the result of this command is not a table"]);
    let fit = ["fit", "t.dgd", "--data", "d.csv", "-o", "fitted.json"];
    dgd_in(folder.path(), &fit).refused(2, &["this command writes a folder"]);
    run(&["track", "t.dgd", "--data", "d.csv", "-o", "t.json"]);
    let document = json("t.json");
    assert_eq!(document["rows"].as_array().map(Vec::len), Some(4));
    assert!(document["settings"]["tracked"]["h"].is_object(), "{document}");
    run(&["track", "t.dgd", "--data", "d.csv", "-o", "t.jsonl"]);
    assert_eq!(read(&folder, "t.jsonl").lines().count(), 5);
    run(&["methods", "-o", "t.json"]);
    assert!(json("t.json")["methods"].is_array());
    // Formatting into another file leaves the model unchanged.
    let untidy = TANK.replace("state h [m] = 1", "state   h [m]=1");
    fs::write(folder.path().join("u.dgd"), &untidy).expect("the folder is writable");
    run(&["fmt", "u.dgd", "-o", "tidy.dgd"]);
    assert_eq!(
        (read(&folder, "u.dgd"), read(&folder, "tidy.dgd").contains("state   h")),
        (untidy, false)
    );
    dgd_in(folder.path(), &["fmt", "u.dgd", "t.dgd", "-o", "x.dgd"]).refused(2, &["one model"]);
}

#[test]
fn what_another_run_left_half_written_is_removed() {
    let folder = folder();
    // No process has this number.
    for name in [".r.csv.4194999-0.tmp", ".r.csv.dgd-4194999-1.tmp"] {
        fs::write(folder.path().join(name), "half").expect("the folder is writable");
    }
    fs::create_dir(folder.path().join(".fitted.dgd-4194999-0.tmp"))
        .expect("the folder is writable");
    let alive = format!(".r.csv.dgd-{}-0.tmp", std::process::id());
    fs::write(folder.path().join(&alive), "half").expect("the folder is writable");
    dgd_in(folder.path(), &["simulate", "t.dgd", "--data", "d.csv", "-o", "r.csv"]).done();
    let mut expected = vec!["d.csv", "g.dgd", "i.dgd", "r.csv", "s.csv", "t.dgd"];
    if cfg!(target_os = "linux") {
        expected.insert(0, &alive);
    }
    assert_eq!(listing(&folder), expected);
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_leaves_nothing_half_written() {
    use std::io::{BufRead, BufReader, Write};
    use std::process::Stdio;

    let folder = folder();
    let mut child = command(folder.path(), &["track", "t.dgd", "--data", "-", "-o", "t.csv"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut input = child.stdin.take().expect("a pipe");
    input.write_all(DATA.as_bytes()).expect("it reads");
    // The first remark shows that it has begun.
    let mut text = BufReader::new(child.stderr.take().expect("a pipe"));
    text.read_line(&mut String::new()).expect("text");
    let is_under_way = || listing(&folder).iter().any(|name| name.contains(".tmp"));
    while !is_under_way() {
        assert!(child.try_wait().expect("a child").is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    crate::support::interrupt(&child);
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    drop(input);
    assert_eq!(listing(&folder), ["d.csv", "g.dgd", "i.dgd", "s.csv", "t.dgd"]);
}

#[test]
fn only_regular_model_files_are_imported_and_nothing_of_others_is_quoted() {
    let secret = "root:x:0:0:secret:/root:/bin/sh\n";
    let folder = folder_with(&[("secret", secret.as_bytes()), ("secret.txt", secret.as_bytes())]);
    let refused = |path: &str| {
        let model =
            format!("model m\nimport \"{path}\"\nstate x = 1\nequation e: der(x) = -x/1 [s]\n");
        fs::write(folder.path().join("m.dgd"), model).expect("the folder is writable");
        for args in [&["check", "m.dgd"][..], &["simulate", "m.dgd", "--until", "1"]] {
            let run = dgd_in(folder.path(), args);
            run.refused(1, &["E208", path]);
            assert!(!run.err.contains("bin/sh") && !run.out.contains("bin/sh"), "{}", run.err);
        }
    };
    for path in ["secret", "secret.txt", "/etc/passwd", "../secret", "/dev/zero", "."] {
        refused(path);
    }
    let large = fs::File::create(folder.path().join("large.dgd")).expect("the folder is writable");
    large.set_len((16 << 20) + 1).expect("there is room");
    refused("large.dgd");
    fs::create_dir(folder.path().join("folder.dgd")).expect("the folder is writable");
    refused("folder.dgd");
    #[cfg(unix)]
    {
        let link = |target: &str, name: &str| {
            std::os::unix::fs::symlink(target, folder.path().join(name)).expect("writable");
        };
        link("/etc/passwd", "passwd.dgd");
        link("secret", "link.dgd");
        link("/dev/zero", "zero.dgd");
        let fifo = folder.path().join("fifo.dgd");
        let made = std::process::Command::new("mkfifo").arg(&fifo).status();
        assert!(made.is_ok_and(|status| status.success()), "there is `mkfifo`");
        for path in ["passwd.dgd", "link.dgd", "zero.dgd", "fifo.dgd"] {
            refused(path);
        }
    }
    // A file elsewhere is read as before.
    fs::create_dir(folder.path().join("lib")).expect("the folder is writable");
    fs::write(folder.path().join("lib/k.dgd"), "constant k = 2\n").expect("the folder is writable");
    fs::create_dir(folder.path().join("m")).expect("the folder is writable");
    let model = "model m\nimport \"../lib/k.dgd\"\nstate x = k\nequation e: der(x) = -x/1 [s]\n";
    fs::write(folder.path().join("m/m.dgd"), model).expect("the folder is writable");
    dgd_in(folder.path(), &["check", "m/m.dgd"]).done();
}

#[cfg(unix)]
#[test]
fn devices_and_named_pipes_are_refused_at_once() {
    let folder = folder();
    let made = std::process::Command::new("mkfifo").arg(folder.path().join("pipe")).status();
    assert!(made.is_ok_and(|status| status.success()), "there is `mkfifo`");
    let cases: [(&[&str], &str); 10] = [
        (&["simulate", "t.dgd", "--data", "/dev/zero"], "it is a device"),
        (&["simulate", "t.dgd", "--data", "/dev/full"], "it is a device"),
        (&["simulate", "t.dgd", "--data", "pipe"], "it is a named pipe"),
        (&["track", "t.dgd", "--data", "pipe"], "it is a named pipe"),
        (&["track", "t.dgd", "--data", "/dev/zero"], "it is a device"),
        (&["screen", "--data", "pipe"], "it is a named pipe"),
        (&["simulate", "t.dgd", "--data", "d.csv", "--ensemble", "pipe"], "it is a named pipe"),
        (&["check", "/dev/zero"], "it is a device"),
        (&["check", "pipe"], "it is a named pipe"),
        (&["simulate", "t.dgd", "--data", "."], "it is a folder"),
    ];
    for (args, part) in cases {
        at_once(folder.path(), args).refused(1, &[part]);
    }
    // A pipe that is already open has a writer.
    let mut run = command(folder.path(), &["simulate", "t.dgd", "--data", "/dev/stdin"]);
    let mut cat = std::process::Command::new("cat")
        .arg(folder.path().join("d.csv"))
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("there is `cat`");
    run.stdin(cat.stdout.take().expect("a pipe"));
    assert_eq!(Run::of(&run.output().expect("it starts")).done().out.lines().count(), 5);
    cat.wait().expect("it ends");
}
