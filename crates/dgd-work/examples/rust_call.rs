//! Time of `dgd_work::simulate` without Python, for a model and a recording, from a file and from columns in memory:
//! the shortest of many calls, in ms. `crates/dgd-python/tests/measure.py` compares its own call with it.
//!
//! `cargo run --release --package dgd-work --example rust_call -- MODEL DATA`

use std::path::PathBuf;
use std::time::Instant;

use dgd_data::{DataColumns, DiskFiles, InMemory, LayeredFiles};
use dgd_work::{RunRequest, SilentReporter, SimulateRequest, TaskContext, WorkError, simulate};

/// Timed calls.
const CALLS: usize = 60;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(model), Some(data)) = (words.next(), words.next()) else {
        return Err("rust_call MODEL DATA".into());
    };
    let text = std::fs::read_to_string(&data)?;
    let above = InMemory::default().with_columns("columns", columns(&text));
    let files = LayeredFiles { above: &above, below: &DiskFiles };
    let session = TaskContext::new(&SilentReporter).with_files(&files);
    for (name, path) in [("file", data.as_str()), ("columns", "columns")] {
        let mut run = RunRequest::new(&model);
        run.data = Some(PathBuf::from(path));
        let request = SimulateRequest::new(run);
        println!("{name} {:.3}", least(|| simulate(&request, session))?);
    }
    Ok(())
}

/// The shortest time of a call, ms.
fn least<T>(call: impl Fn() -> Result<T, WorkError>) -> Result<f64, WorkError> {
    let mut least = f64::INFINITY;
    for _ in 0..CALLS {
        let begin = Instant::now();
        let result = call()?;
        least = least.min(1e3 * begin.elapsed().as_secs_f64());
        drop(result);
    }
    Ok(least)
}

/// The columns of a CSV text.
fn columns(text: &str) -> DataColumns {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let headers = lines.next().unwrap_or_default().split(',');
    let mut columns: Vec<(String, Vec<f64>)> =
        headers.map(|header| (header.to_owned(), Vec::new())).collect();
    for line in lines {
        for (cell, (_, values)) in line.split(',').zip(&mut columns) {
            values.push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    DataColumns { all: columns }
}
