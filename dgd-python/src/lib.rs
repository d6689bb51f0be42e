//! The native part of the Python package: requests from Python to `dgd-work`, results back.
//!
//! Python holds what is convenient: frames, units by attributes, pictures, notebooks. Here are the calls alone, each of
//! which releases the interpreter's lock, minds Ctrl-C, and turns what goes wrong into an exception; no panic gets
//! through ([`guard`]).

mod data;
mod errors;
mod figure;
mod guard;
mod model;
mod numbers;
mod observer;
mod options;
mod points;
mod results;
mod tracker;
mod workers;

use std::ffi::OsString;
use std::path::PathBuf;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{Source, Sources};
use dgd_compiler::syntax::layout;
use dgd_scratch::Scratch;
use pyo3::prelude::*;

/// What `--memory` of the command limits.
#[global_allocator]
static ALLOCATOR: Scratch = Scratch;

/// The version of dgd.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Runs a command line, the words behind `dgd`; the exit code.
#[pyfunction]
fn command(py: Python<'_>, words: Vec<OsString>) -> PyResult<u8> {
    // Work on many wells starts the command again, by the same interpreter.
    let executable: OsString = py.import("sys")?.getattr("executable")?.extract()?;
    let file: PathBuf = py.import("dgd._dgd")?.getattr("__file__")?.extract()?;
    let start = [executable, "-m".into(), "dgd".into()];
    Ok(py.detach(|| dgd_cli::run_words_of(start.into(), file, words)))
}

/// The text of a model as `dgd fmt` lays it out; as it is where it cannot be read. A command would mind Ctrl-C for the
/// rest of the process.
#[pyfunction]
fn laid_out(text: String) -> String {
    let (mut sources, mut diagnostics) = (Sources::default(), Diagnostics::default());
    let id = sources.add(Source { name: String::new(), text: text.clone() });
    layout::format(id, &sources, &mut diagnostics).unwrap_or(text)
}

// The interpreter's lock is needed: nothing here was written for Python without one.
#[pymodule(gil_used = true)]
fn _dgd(module: &Bound<'_, PyModule>) -> PyResult<()> {
    guard::hear_panics();
    module.add("__version__", VERSION)?;
    module.add_function(wrap_pyfunction!(command, module)?)?;
    module.add_function(wrap_pyfunction!(laid_out, module)?)?;
    module.add_function(wrap_pyfunction!(model::load, module)?)?;
    module.add_function(wrap_pyfunction!(guard::panic_for_test, module)?)?;
    module.add_class::<data::Table>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<results::Run>()?;
    module.add_class::<results::Found>()?;
    module.add_class::<points::Equations>()?;
    module.add_class::<points::Objective>()?;
    module.add_class::<tracker::Tracker>()
}
