//! Reading and selecting: every mistake at its place, and accepted input.

use std::io::Write as _;

use dgd_compiler::argument::neutral;
use dgd_compiler::diagnostics::render::{RenderStyle, entry, render};
use dgd_compiler::diagnostics::{Code, Diagnostics, ErrorReported};
use dgd_compiler::source::SourceMap;
use dgd_compiler::units::{Unit, parse_unit};

use crate::read::ReadOptions;
use crate::read::read_with;
use crate::select::{DeclaredColumn, inputs, measured, unknown, unknown_note};
use crate::table::DisorderPolicy;
use crate::write::HAS_PARQUET;
use crate::{DataTable, Rename, read, read_from};

/// Reads a text; also returns the mistakes as `code line:column message`.
fn table(text: impl AsRef<[u8]>) -> (Option<DataTable>, Vec<String>) {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let table = read_from("a.csv", text.as_ref(), &mut sources, &mut diagnostics);
    assert_eq!(table.is_err(), diagnostics.check().is_err());
    (table.ok(), list(&diagnostics, &sources))
}

fn list(diagnostics: &Diagnostics, sources: &SourceMap) -> Vec<String> {
    let sorted = diagnostics.sorted();
    // Every diagnostic can be drawn.
    assert_eq!(render(&sorted, sources, RenderStyle::Plain).is_empty(), sorted.is_empty());
    let entries = sorted.iter().map(|diagnostic| entry(diagnostic, sources, neutral));
    entries
        .map(|e| format!("{} {}:{} {}", e.code, e.places[0].line, e.places[0].column, e.message))
        .collect()
}

fn good(text: impl AsRef<[u8]>) -> DataTable {
    let (table, errors) = table(text);
    table.unwrap_or_else(|| panic!("{errors:?}"))
}

fn errors(text: impl AsRef<[u8]>) -> Vec<String> {
    table(text).1
}

fn unit(text: &str) -> Unit {
    parse_unit(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Selects one input or output called `x`, declared in this unit.
fn select<T>(
    text: &str,
    declared: &str,
    with: impl FnOnce(&DataTable, &[DeclaredColumn<'_>], &mut Diagnostics) -> Result<T, ErrorReported>,
) -> Result<T, Vec<String>> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let unit = unit(declared);
    let declared = DeclaredColumn { name: "x", unit: &unit, place: None };
    read_from("a.csv", text.as_bytes(), &mut sources, &mut diagnostics)
        .and_then(|table| with(&table, &[declared], &mut diagnostics))
        .map_err(|_| list(&diagnostics, &sources))
}

fn input(text: &str, declared: &str) -> Result<Vec<f64>, Vec<String>> {
    select(text, declared, inputs).map(|mut all| all.remove(0))
}

fn output(text: &str, declared: &str) -> Result<Option<Vec<f64>>, Vec<String>> {
    select(text, declared, measured).map(|mut all| all.remove(0))
}

#[test]
fn a_recording_is_columns_and_seconds() {
    let table = good("time [min],q [lpm],\"p, raw [bar]\"\n2, 300 ,1e1\n2.5,NaN,\n3,na,-2\n");
    assert_eq!(table.time.as_deref(), Some([0.0, 30.0, 60.0].as_slice()));
    assert_eq!(table.len(), 3);
    assert_eq!(table.columns[1].name, "p, raw");
    assert_eq!(table.columns[0].unit.as_ref().map(|unit| unit.symbol.as_str()), Some("lpm"));
    let [first, rest @ ..] = table.columns[0].values.as_slice() else { panic!("no values") };
    assert_eq!(*first, 300.0);
    assert!(rest.iter().all(|value| value.is_nan()));
    assert_eq!(table.columns[0].missing.as_ref().map(|cells| cells.count), Some(2));
    assert_eq!(table.columns[1].values[2], -2.0);
}

#[test]
fn a_table_without_time_has_independent_rows() {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let text = b"x [m],y [m]\n3,1\n1,2\n1,3\n1,4\n";
    let table = read_from("a.csv", text.as_slice(), &mut sources, &mut diagnostics)
        .expect("rows may be in any order");
    assert_eq!((table.len(), table.columns.len(), table.time.is_none()), (4, 2, true));
    assert!(table.recording(&mut diagnostics).is_err());
    assert_eq!(list(&diagnostics, &sources), ["E602 1:1 the file has no time column"]);
}

#[test]
fn what_stands_around_the_table_does_not_matter() {
    let plain = good("time [s],x [m]\n0,1\n1,2\n");
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(b"time [s],x [m]\n0,1\n").expect("to memory");
    let mut stream = gzip.finish().expect("to memory");
    // A gzip file may consist of several streams.
    let mut gzip = flate2::write::GzEncoder::new(&mut stream, flate2::Compression::default());
    gzip.write_all(b"1,2\n").expect("to memory");
    gzip.finish().expect("to memory");
    let text: [&[u8]; 4] = [
        "\u{feff}time [s],x [m]\r\n0,1\r\n1,2".as_bytes(),
        b"# source: a rig\n\n# unit: m\r\ntime [s] , x [m]\n\n0,1\n1,2\n\n \n",
        b"\"time [s]\",\"x [m]\"\n\"0\",\"1\"\n\" 1\",\"2 \"\n",
        &stream,
    ];
    for text in text {
        let table = good(text);
        assert_eq!(table.time, plain.time);
        assert_eq!(table.columns[0].values, plain.columns[0].values);
        assert_eq!(table.columns[0].name, "x");
    }
    assert_eq!(
        errors("# a\n# b\ntime [s],x [m]\n0,1\n# c,2\n"),
        ["E607 5:1 `# c` is neither a number nor an ISO 8601 stamp"]
    );
}

#[test]
fn stamps_are_times() {
    let text = "x [m]\n2026-11-21T10:00:00Z,1\n2026-11-21T11:00:00.5+01:00,2\n";
    for header in ["time,", "time [s],"] {
        let table = good(format!("{header}{text}"));
        assert_eq!(table.time.as_deref(), Some([0.0, 0.5].as_slice()));
    }
    assert_eq!(errors("time,x [m]\n0,1\n1,1\n"), ["E607 2:1 `0` has no unit of time"]);
    assert_eq!(
        errors("time,x\n2026-11-21T10:00:00Z,1\n2026-11-21T10:00:01,1\n"),
        ["E607 3:1 of this stamp and the first, one has a zone and the other has none"]
    );
}

#[test]
fn time_goes_forward_and_stands_still_once() {
    let table = good("time [s],x\n0,1\n1,1\n1,2\n2,2\n2,3\n");
    assert_eq!(table.time.as_deref(), Some([0.0, 1.0, 1.0, 2.0, 2.0].as_slice()));
    assert_eq!(
        errors("time [s],x\n0,1\n1,1\n1,2\n1,3\n1,4\n0.5,1\n0.2,1\n"),
        ["E605 7:1 time runs backwards: `0.5` comes after `1`"]
    );
    assert_eq!(errors("time [s],x\n0,1\n,1\n"), ["E607 3:1 this row has no time"]);
    assert_eq!(errors("time [s]\n1e308\n-1e308\n").len(), 1);
}

#[test]
fn files_that_are_no_tables_are_refused() {
    for text in ["", "\u{feff}", "\n \n"] {
        assert_eq!(
            errors(text),
            [format!("E601 {}:1 cannot read `a.csv`: it is empty", {
                text.matches('\n').count() + 1
            })]
        );
    }
    assert_eq!(errors("# only\n"), ["E601 2:1 cannot read `a.csv`: it has no header line"]);
    assert_eq!(errors("x [m]\n"), ["E612 1:1 the table has no rows"]);
    assert_eq!(
        errors(b"x [m]\n1\n\xe9\n")[0],
        "E601 3:1 cannot read `a.csv`: this is not UTF-8 text"
    );
    for magic in [b"\xd0\xcf\x11\xe0".as_slice(), b"PK\x03\x04", b"\xff\xfet\0"] {
        assert!(errors(magic)[0].starts_with("E601 1:1 cannot read `a.csv`: it"), "{magic:?}");
    }
    if !HAS_PARQUET {
        let refused = errors(b"PAR1 a table PAR1");
        assert!(refused[0].ends_with("it is Parquet, which this build does not read"));
    }
    assert!(errors(b"\x1f\x8b\x08\x00")[0].starts_with("E601"));
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    for path in ["no/such/file.csv", "."] {
        assert!(read(path.as_ref(), &mut sources, &mut diagnostics).is_err());
    }
    assert!(list(&diagnostics, &sources).iter().all(|error| error.starts_with("E601 1:1 cannot")));
}

#[test]
fn headers_and_rows_that_cannot_be_trusted_are_refused() {
    for (text, error) in [
        ("time [s];x [m]\n0;1\n", "E609 1:1 the columns are separated by semicolons"),
        ("x [m],time [s]\n0,1\n", "E609 1:7 the time is not in the first column"),
        ("time [s],time [s]\n0,1\n", "E609 1:10 two columns are called `time`"),
        ("time [m],x [m]\n0,1\n", "E604 1:1 `time` is in `m`, which is not a unit of time"),
        ("time [s,x [m]\n0,1\n", "E609 1:1 malformed column header: a `[` is not closed"),
        ("time [sek],x [m]\n0,1\n", "E305 1:7 there is no unit `sek`"),
        ("\"x [m]\n0\n1\n", "E609 1:1 a quoted cell is not closed"),
        ("x [m]\n0\n\"1\n2\n", "E610 3:1 a quoted cell is not closed"),
        ("x,y\n0,1\n1,2,3,4\n5\n", "E610 3:5 this row has 4 cells, and the header 2 cells"),
        ("x,y\n0,1\n5\n", "E610 3:1 this row has 1 cell, and the header 2 cells"),
    ] {
        assert_eq!(errors(text), [error]);
    }
}

#[test]
fn inputs_are_found_and_converted() {
    assert_eq!(input("y,x [lpm]\n1,60000\n", "m^3/s"), Ok(vec![1.0]));
    assert_eq!(input("x [°C]\n20\n", "K"), Ok(vec![20.0 + 273.15]));
    assert_eq!(input("x [K]\n20\n", "degC"), Ok(vec![20.0]));
    assert_eq!(input("x [%]\n50\n", "1"), Ok(vec![0.5]));
    assert_eq!(input("x\n50\n", "1"), Ok(vec![50.0]));
    // The reference of a pressure counts only if both have one and they differ.
    for (column, declared, si) in [
        ("barg", "bara", 201_325.0),
        ("bara", "barg", -1_325.0),
        ("bara", "bara", 100_000.0),
        ("barg", "bar", 100_000.0),
        ("bar", "bara", 100_000.0),
        ("kPa", "bara", 1_000.0),
    ] {
        assert_eq!(input(&format!("x [{column}]\n1\n"), declared), Ok(vec![si]), "{column}");
    }
}

#[test]
fn what_is_wrong_with_an_input_is_told_at_its_place() {
    for (text, declared, error) in [
        ("y,X [m]\n1,2\n", "m", "E603 1:1 there is no column for the input `x`"),
        (
            "y,x [bar]\n1,2\n",
            "m",
            "E604 1:3 the column `x` is in `bar`, which does not convert to `m`",
        ),
        ("y,x\n1,2\n", "m", "E609 1:3 the column `x` has no unit"),
        ("y,x\n1,2\n", "%", "E609 1:3 the column `x` has no unit"),
        ("y,x [m\n1,2\n", "m", "E609 1:3 malformed column header: a `[` is not closed"),
        ("y,x [furlong]\n1,2\n", "m", "E305 1:6 there is no unit `furlong`"),
        ("y,x [m],x [m]\n1,2,3\n", "m", "E609 1:9 two columns are called `x`"),
        ("y,x [m]\n1,2\n1,2;5\n1,a\n", "m", "E607 3:3 `2;5` is not a number"),
        ("y,x [m]\n1,inf\n", "m", "E607 2:3 `inf` is not a number"),
        ("y,x [m]\n1,2\n1,\n1,NA\n", "m", "E608 3:3 the input `x` has no value here"),
        (
            "time [s],x [m]\n0,2\n1,3\n1,3\n1,3\n1,4\n",
            "m",
            "E606 6:1 three rows or more have the time `1` and differ in the input `x`",
        ),
        (
            "time [s],x [m]\n0,2\n1,2\n1,3\n1,3\n",
            "m",
            "E606 5:1 three rows or more have the time `1` and differ in the input `x`",
        ),
    ] {
        assert_eq!(input(text, declared), Err(vec![error.to_owned()]));
    }
}

#[test]
fn rows_of_one_time_that_agree_are_replicates() {
    let text = "time [s],x [m],y [m]\n0,1,1\n1,3,2\n1,3,5\n1,3,4\n2,3,2\n2,4,2\n";
    let table = good(text);
    assert_eq!(table.time.as_deref(), Some([0.0, 1.0, 1.0, 1.0, 2.0, 2.0].as_slice()));
    assert_eq!(input(text, "m"), Ok(vec![1.0, 3.0, 3.0, 3.0, 3.0, 4.0]));
    // Outputs and unknown columns may differ.
    let replicates: Vec<[usize; 2]> = table.replicates.iter().map(|r| [r.first, r.row]).collect();
    assert_eq!(replicates, [[1, 3]]);
}

#[test]
fn outputs_may_be_absent_or_have_gaps() {
    assert_eq!(output("y\n1\n", "m"), Ok(None));
    let Ok(Some(values)) = output("x [bara]\n1\n\"\"\n", "Pa") else { panic!("a column") };
    assert_eq!(values[0], 1e5);
    assert!(values[1].is_nan());
    assert!(output("x [bara]\na\n", "Pa").is_err());
}

#[test]
fn columns_nobody_asks_for_are_only_named() {
    let table = good("time [s],x [m],comment,P_r [furlong],depth [m\n0,1,ok,-,\n");
    let known = ["x", "p_r"];
    let names: Vec<_> = unknown(&table, &known).iter().map(|column| &column.name).collect();
    assert_eq!(names, ["comment", "P_r", "depth"]);
    let note = unknown_note(&table, &known).expect("there are some");
    assert_eq!(note.code, Code::UnknownColumn);
    assert_eq!(
        note.message,
        "the model does not know the columns `comment`, `P_r`, `depth`, which are not used"
    );
    assert_eq!(
        note.help.map(|help| help.to_string()).as_deref(),
        Some("is `P_r` meant to be `p_r`?")
    );
    assert_eq!(unknown_note(&good("time [s],x [m]\n0,1\n"), &known), None);
}

#[test]
fn in_a_long_file_lines_are_told_in_words() {
    let text = "# long\ntime [s],x [m]\r\n0,1\r\n\r\n1,a\r\n0,b\r\n";
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    // As if only this many bytes could be kept.
    let kept = "# long\ntime [s],x [m]\r\n0,1".len();
    let table = read_with(reading(kept), "a.csv", text.as_bytes(), &mut sources, &mut diagnostics);
    assert!(table.is_err());
    let [diagnostic] = diagnostics.sorted()[..] else { panic!("{diagnostics:?}") };
    let drawn = render(&[diagnostic], &sources, RenderStyle::Plain);
    assert!(drawn.contains("a.csv:2:1") && drawn.contains("line 6"), "{drawn}");
    assert!(drawn.contains("line 5: the row before"), "{drawn}");
    assert_eq!(sources.iter().next().map(|s| s.text.as_str()), Some("# long\ntime [s],x [m]"));
}

#[test]
fn no_bytes_make_it_panic() {
    // Meaningful fragments in a pseudorandom order (Knuth's 64-bit linear congruential generator).
    let pieces: [&[u8]; 24] = [
        b",",
        b"\n",
        b"\r\n",
        b"\"",
        b"\"\"",
        b"time [s]",
        b"time",
        b"x [m]",
        b"[",
        b"]",
        b"#",
        b" ",
        b"1",
        b"-3e5",
        b"nan",
        b"2026-11-21T10:00:00Z",
        b"\xff",
        "é".as_bytes(),
        b"\0",
        b"\x1f\x8b",
        b"1e999",
        b";",
        b"\xef\xbb\xbf",
        b"x [\xc2\xb0C]",
    ];
    let mut state = 1_u64;
    let mut next = |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for _ in 0..3000 {
        let text: Vec<u8> =
            (0..next(40)).flat_map(|_| pieces[next(pieces.len())]).copied().collect();
        let limit = next(2 * text.len() + 2);
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let read =
            read_with(reading(limit), "a.csv", text.as_slice(), &mut sources, &mut diagnostics);
        if let Ok(table) = &read {
            let unit = unit("m");
            let declared = [DeclaredColumn { name: "x", unit: &unit, place: None }];
            let _ = inputs(table, &declared, &mut diagnostics);
            let _ = measured(table, &declared, &mut diagnostics);
            let _ = table.recording(&mut diagnostics);
            assert!(table.columns.iter().all(|column| column.values.len() == table.len()));
            if let Some(time) = &table.time {
                assert!(time.windows(2).all(|pair| pair[0] <= pair[1]));
                assert!(time.windows(3).all(|three| three[0] < three[2]));
            }
        } else {
            assert!(diagnostics.check().is_err());
        }
        list(&diagnostics, &sources);
    }
}

fn reading(kept: usize) -> ReadOptions<'static> {
    ReadOptions { kept, order: DisorderPolicy::Required, renames: &[], wanted: None }
}

#[test]
fn columns_take_other_names_and_units() {
    let renames: Vec<Rename> = ["P_RIS=p_r [barg]", "clock=time", "Q 1=q"]
        .iter()
        .map(|text| text.parse().expect("a new name"))
        .collect();
    let read = |text: &str, renames: &[Rename]| {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let reading = ReadOptions { renames, ..reading(1000) };
        read_with(reading, "a.csv", text.as_bytes(), &mut sources, &mut diagnostics)
            .map_err(|_| diagnostics.sorted().iter().map(|d| d.message.clone()).collect::<Vec<_>>())
    };
    let text = "clock [s],P_RIS,Q 1 [lpm]\n0,1,2\n1,1,2\n";
    let table = read(text, &renames).expect("a recording");
    let names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!((names.as_slice(), table.time), (["p_r", "q"].as_slice(), Some(vec![0.0, 1.0])));
    let units = table.columns.iter().map(|c| c.unit.as_ref().map(|unit| unit.symbol.clone()));
    assert_eq!(units.collect::<Vec<_>>(), [Some("barg".to_owned()), Some("lpm".to_owned())]);
    // Another file may already have the names; one with neither is refused.
    assert!(read("time [s],p_r [bar],q [lpm]\n0,1,2\n", &renames).is_ok());
    let refused = read("time [s],P_RISE [bar],q [lpm]\n0,1,2\n", &renames).expect_err("neither");
    assert_eq!(refused, ["there is no column `P_RIS`, which is to be called `p_r`"]);
    assert!("P_RIS".parse::<Rename>().is_err());
}

#[test]
fn rows_out_of_order_are_left_out_and_told_where_that_is_asked_for() {
    let text = "time [s],x [m]\n0,1\n0.8,2\n1,3\n1,4\n1,9\n0.5,9\n0.7,9\n2,5\n";
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let reading = ReadOptions { order: DisorderPolicy::Recorded, ..reading(1000) };
    let table = read_with(reading, "a.csv", text.as_bytes(), &mut sources, &mut diagnostics)
        .expect("a recording");
    assert_eq!(table.time, Some(vec![0.0, 0.8, 1.0, 1.0, 2.0]));
    assert_eq!(table.columns[0].values, [1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(table.len(), 5);
    assert_eq!(table.disorder.left_out, 3);
    assert_eq!(table.disorder.backwards.as_deref(), Some("`0.5` comes after `1`"));
    assert_eq!(table.disorder.crowded.as_deref(), Some("1"));
}

#[test]
fn as_few_rows_are_left_out_as_it_takes() {
    let read = |times: &[&str]| {
        let rows: Vec<String> =
            times.iter().enumerate().map(|(k, time)| format!("{time},{k}\n")).collect();
        let text = format!("time [s],x [m]\n{}", rows.concat());
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let reading = ReadOptions { order: DisorderPolicy::Recorded, ..reading(1000) };
        let table = read_with(reading, "a.csv", text.as_bytes(), &mut sources, &mut diagnostics)
            .expect("a recording");
        assert_eq!(table.time.as_ref().map(Vec::len), Some(table.len()));
        (table.time.unwrap_or_default(), table.columns[0].values.clone(), table.disorder)
    };
    // One time far ahead, in the middle, at the end of the first, and at the start.
    let (times, x, disorder) = read(&["0", "1", "4e9", "3", "4"]);
    assert_eq!((times, x), (vec![0.0, 1.0, 3.0, 4.0], vec![0.0, 1.0, 3.0, 4.0]));
    assert_eq!(disorder.left_out, 1);
    assert_eq!(disorder.backwards.as_deref(), Some("`3` comes after `4e9`, which is ahead"));
    let (times, x, disorder) = read(&["5000", "11", "12.5", "13"]);
    assert_eq!((times, x), (vec![0.0, 1.5, 2.0], vec![1.0, 2.0, 3.0]));
    assert_eq!(disorder.left_out, 1);
    // One far behind.
    let (times, x, disorder) = read(&["10", "11", "2", "13"]);
    assert_eq!((times, x), (vec![0.0, 1.0, 3.0], vec![0.0, 1.0, 3.0]));
    assert_eq!(disorder.backwards.as_deref(), Some("`2` comes after `11`"));
    // A clock that is set back shows times twice.
    let (times, x, _) = read(&["0", "1", "2", "3", "1.5", "2.5", "3.5", "4.5"]);
    assert_eq!(
        (times, x),
        (vec![0.0, 1.0, 2.0, 3.0, 3.5, 4.5], vec![0.0, 1.0, 2.0, 3.0, 6.0, 7.0])
    );
    // Two rows at one time are a jump, three are too many, in any order.
    let (times, x, disorder) = read(&["0", "1", "1", "0.5", "1", "2"]);
    assert_eq!((times, x), (vec![0.0, 1.0, 1.0, 2.0], vec![0.0, 1.0, 2.0, 5.0]));
    assert_eq!(disorder.left_out, 2);
}

#[test]
fn new_names_are_read_as_carefully_as_headers() {
    let read = |text: &str, rename: &str| {
        let renames = [rename.parse::<Rename>().expect("a new name")];
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let reading = ReadOptions { renames: &renames, ..reading(1000) };
        let table = read_with(reading, "a.csv", text.as_bytes(), &mut sources, &mut diagnostics);
        let sorted = diagnostics.sorted();
        assert_eq!(table.is_err(), !render(&sorted, &sources, RenderStyle::Plain).is_empty());
        let entries = sorted.iter().map(|diagnostic| entry(diagnostic, &sources, neutral));
        let list: Vec<String> = entries
            .map(|e| format!("{}:{} {}", e.places[0].file, e.places[0].column, e.message))
            .collect();
        (table.ok(), list)
    };
    let (_, refused) = read("time [s],P [bar],P [bar]\n0,1,2\n", "P=p_in");
    assert_eq!(
        refused,
        ["a.csv:18 two columns are called `P`, one of which is to be called `p_in`"]
    );
    let (_, refused) = read("time [s],P [psi]\n0,1\n", "P=p_in [bar");
    assert_eq!(refused, ["(rename):3 malformed column name: a `[` is not closed"]);
    for header in ["T [°C]", "T [K]", "\"T\"", "T [\u{b0}\u{b0}\u{b0}\u{b0}]"] {
        let (_, refused) = read(&format!("time [s],{header}\n0,1\n"), "T=T_a [xx]");
        assert_eq!(refused.len(), 1, "{refused:?}");
        assert!(
            refused[0].starts_with("(rename):8 ") && refused[0].contains("`xx`"),
            "{refused:?}"
        );
    }
    // Without a unit in the new name, the unit of the file applies, including its faults.
    let (table, _) = read("time [s],T [°C]\n0,1\n", "T=T_a");
    let column = &table.expect("a recording").columns[0];
    assert_eq!((column.name.as_str(), column.unit.as_ref()), ("T_a", Some(&unit("°C"))));
    let (table, _) = read("time [s],T [°C\n0,1\n", "T=T_a");
    assert!(table.expect("a recording").columns[0].fault.is_some());
    let (table, _) = read("time [s],T [°C\n0,1\n", "T=T_a [K]");
    assert!(table.expect("a recording").columns[0].fault.is_none());
}

#[test]
fn a_bad_new_name_is_one_mistake_for_all_files() {
    let renames = ["P=p_in [bar".parse::<Rename>().expect("a new name")];
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    for name in ["a.csv", "b.csv"] {
        let (reading, text) =
            (ReadOptions { renames: &renames, ..reading(1000) }, "time [s],P\n0,1\n");
        assert!(read_with(reading, name, text.as_bytes(), &mut sources, &mut diagnostics).is_err());
    }
    assert_eq!(diagnostics.sorted().len(), 1);
}

#[test]
fn a_text_that_begins_as_a_parquet_file_is_a_text() {
    let text = format!("PAR1 [bar],x [m]\n{}", "1,2\n".repeat(1000));
    for kept in [100, 100_000] {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let read =
            read_with(reading(kept), "a.csv", text.as_bytes(), &mut sources, &mut diagnostics);
        let table = read.expect("a table");
        assert_eq!((table.columns[0].name.as_str(), table.len()), ("PAR1", 1000));
    }
    assert!(errors(b"PAR1\x15\xff\x00")[0].ends_with("it is a Parquet file without its end"));
}
