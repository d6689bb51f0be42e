//! Where rows come from: a file that is read whole, or standard input as it is written.

use std::path::Path;

use dgd_compiler::dae::Dae;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::Sources;

use crate::args::SolveArgs;
use crate::console::Console;
use crate::data::select::Gaps;
use crate::data::stream::Stream;
use crate::data::{self};
use crate::failure::CommandError;
use crate::recording::{Clock, Known, Recording};

/// A row, SI; NaN where there is no value.
#[derive(Debug, Clone, Default)]
pub(super) struct Row {
    pub t: f64,
    pub u: Vec<f64>,
    pub measured: Vec<f64>,
}

/// Rows, one after the other.
pub(super) struct Rows {
    source: From,
    n_inputs: usize,
    /// For each output, whether it has a column.
    pub measured: Vec<bool>,
    from: f64,
    until: f64,
}

enum From {
    File { recording: Recording, next: usize },
    Stream { stream: Stream<'static>, values: Vec<f64> },
}

impl Rows {
    /// Opens a file, or standard input for `-`; `None` where there are mistakes, which are reported.
    pub(super) fn open(
        path: &Path,
        dae: &Dae,
        sources: &mut Sources,
        diagnostics: &mut Diagnostics,
        args: &SolveArgs,
        console: Console<'_>,
    ) -> Option<Rows> {
        let known = Known::of(dae);
        let select = |table: &data::Table, sources: &Sources, diagnostics: &mut Diagnostics| {
            Recording::select(
                table,
                &known,
                (Clock::Time, Gaps::Kept),
                sources,
                diagnostics,
                console,
            )
        };
        let (source, recording) = if path == Path::new("-") {
            let stdin = std::io::stdin();
            let opened = Stream::open("standard input", &args.rename, stdin, sources, diagnostics);
            let (mut stream, table) = opened.ok()?;
            let recording = select(&table, sources, diagnostics)?;
            let wanted: Vec<_> = known.inputs().into_iter().chain(known.outputs()).collect();
            stream.want(&table, &wanted);
            (Some(stream), recording)
        } else {
            let table = data::read_renamed(path, &args.rename, sources, diagnostics).ok()?;
            (None, select(&table, sources, diagnostics)?)
        };
        let measured = recording.measured.outputs.iter().map(Option::is_some).collect();
        let source = match source {
            Some(stream) => From::Stream { stream, values: Vec::new() },
            None => From::File { recording, next: 0 },
        };
        let (from, until) = (args.from.unwrap_or(f64::NEG_INFINITY), args.until);
        let n_inputs = dae.inputs.len();
        let until = until.unwrap_or(f64::INFINITY);
        Some(Rows { source, n_inputs, measured, from, until })
    }

    /// The next row between `--from` and `--until`.
    pub(super) fn next(&mut self) -> Result<Option<Row>, CommandError> {
        loop {
            let row = match &mut self.source {
                From::File { recording, next } => {
                    let k = *next;
                    *next += 1;
                    recording.times.get(k).map(|t| Row {
                        t: *t,
                        u: recording.inputs_at(k),
                        measured: (recording.measured.outputs.iter())
                            .map(|samples| samples.as_ref().map_or(f64::NAN, |samples| samples[k]))
                            .collect(),
                    })
                }
                From::Stream { stream, values } => {
                    let t = stream.next(values);
                    let t = t.map_err(|fault| CommandError::Found(fault.to_string()))?;
                    t.map(|t| Row {
                        t,
                        u: values[..self.n_inputs].to_vec(),
                        measured: values[self.n_inputs..].to_vec(),
                    })
                }
            };
            match row {
                Some(row) if row.t < self.from => {}
                Some(row) if row.t > self.until => return Ok(None),
                other => return Ok(other),
            }
        }
    }
}
