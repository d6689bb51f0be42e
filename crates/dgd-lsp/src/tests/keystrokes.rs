//! Measures the time from a keystroke to its diagnostics.

use std::fs;
use std::time::{Duration, Instant};

use serde_json::json;

use super::{Editor, address, files, models};

/// Maximum time for a keystroke.
const MOST: Duration = Duration::from_millis(20);
/// Repetitions of each keystroke; the fastest counts, since other programs can only slow it down.
const TIMES: usize = 9;

/// Measures the release build, as called by `.ci/nightly`, and prints the table.
#[test]
#[ignore = "measures: cargo test --release -p dgd-lsp keystroke -- --ignored --nocapture"]
fn a_keystroke_is_answered_within_20_milliseconds_on_every_model() {
    let mut editor = Editor::new(&models(), "utf-16");
    let mut times: Vec<(Duration, String)> = Vec::new();
    for path in files() {
        let text = fs::read_to_string(&path).expect("a text");
        editor.open(&path, &text);
        let uri = address(&path);
        let mut fastest = Duration::MAX;
        for k in 0..TIMES {
            let begin = Instant::now();
            let start = json!({ "line": 0, "character": 0 });
            let change = json!({ "range": { "start": start, "end": start }, "text": "# \n" });
            editor.change(&uri, k + 2, &json!([change]));
            editor.wait_for(&uri);
            fastest = fastest.min(begin.elapsed());
        }
        let name = path.strip_prefix(models()).expect("a model").display().to_string();
        times.push((fastest, name));
        editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": uri } }));
        editor.wait_for(&uri);
    }
    editor.end();
    times.sort();
    times.reverse();
    println!("milliseconds from a keystroke to its diagnostics");
    for (time, name) in &times {
        println!("{:6.2}  {name}", 1e3 * time.as_secs_f64());
    }
    let slow: Vec<_> = times.iter().filter(|(time, _)| *time >= MOST).collect();
    assert!(slow.is_empty(), "longer than {MOST:?}: {slow:?}");
}
