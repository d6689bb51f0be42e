//! Reads rows from a file, or from a stream as it is written. They are read one by one, and unreadable ones are left
//! out; with `--strict` a file is read whole before anything is computed.

use std::io::{BufRead, Read};
use std::path::Path;

use dgd_compiler::dae::Dae;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::SourceMap;
use dgd_data::select::GapPolicy;
use dgd_data::stream::RowStream;
use dgd_data::{self as data, Epoch, FileSystem, ReadOptions, Sha256Digest};

use crate::error::{UnusableFile, WorkError};
use crate::request::TrackRequest;
use crate::run::densities;
use crate::run::recording::{KnownColumns, RunRecording, TimeColumnRule};
use crate::session::TaskContext;

/// A row, SI; NaN marks a missing value.
#[derive(Debug, Clone, Default)]
pub(super) struct TrackRow {
    pub t: f64,
    pub u: Vec<f64>,
    pub measured: Vec<f64>,
}

/// An unreadable row.
#[derive(Debug, Clone)]
pub(super) struct UnreadableRow {
    pub line: usize,
    pub reason: String,
}

/// Rows, one after the other.
pub(super) struct TrackRows<'a> {
    source: RowSource,
    digest: Option<Sha256Digest>,
    session: TaskContext<'a>,
    is_strict: bool,
    /// Rows left out since the last call of [`Self::take_left_out`].
    left_out: Vec<UnreadableRow>,
    /// Their total number.
    pub n_left_out: usize,
    n_inputs: usize,
    /// For each output, whether it has a column.
    pub measured: Vec<bool>,
    from: f64,
    until: f64,
    /// Upper bound of the number of rows, if known.
    most: Option<usize>,
}

enum RowSource {
    File { recording: RunRecording, next: usize },
    Stream { stream: RowStream<'static>, values: Vec<f64> },
}

impl<'a> TrackRows<'a> {
    /// Opens the stream, or otherwise the file; `None` after mistakes, which are reported.
    pub(super) fn open(
        dae: &Dae,
        sources: &mut SourceMap,
        diagnostics: &mut Diagnostics,
        request: &TrackRequest,
        input: Option<Box<dyn Read>>,
        session: TaskContext<'a>,
    ) -> Option<TrackRows<'a>> {
        let TrackRequest { data: path, solve, strict, .. } = request;
        let (files, known) = (session.files, KnownColumns::from_dae(dae));
        let select =
            |table: &data::DataTable, sources: &SourceMap, diagnostics: &mut Diagnostics| {
                RunRecording::select(
                    table,
                    &known,
                    TimeColumnRule::Time,
                    GapPolicy::Kept,
                    sources,
                    diagnostics,
                    session,
                )
            };
        let is_file = input.is_none();
        let (source, recording) = if input.is_some() || !(*strict || is_parquet(files, path)) {
            let path_name = path.display().to_string();
            let is_piped = input.is_some() && path.as_os_str() == "-";
            let name = if is_piped { "standard input" } else { &path_name };
            let input: Box<dyn Read> = match input.map_or_else(|| files.open(path), Ok) {
                Ok(input) => input,
                Err(why) => {
                    diagnostics.error(data::cannot_read(name, sources, &why));
                    return None;
                }
            };
            let opened = RowStream::open(name, &solve.rename, input, sources, diagnostics);
            let (mut stream, table) = opened.ok()?;
            let recording = select(&table, sources, diagnostics)?;
            let wanted: Vec<_> = known.inputs().into_iter().chain(known.outputs()).collect();
            stream.want(&table, &wanted);
            (Some(stream), recording)
        } else {
            let table = ReadOptions::default()
                .renamed(&solve.rename)
                .read(files, path, sources, diagnostics)
                .ok()?;
            (None, select(&table, sources, diagnostics)?)
        };
        for (output, deviations) in known.outputs().iter().zip(&recording.measured.deviations) {
            if deviations.is_some() {
                let instead = "`dgd track` uses one standard deviation for all readings";
                densities::remark_unused(output.name, instead, session);
            }
        }
        // A file is read once more for its digest, because the header of a run comes before its rows.
        let whole = || files.open(path).ok().and_then(|file| Sha256Digest::read(file).ok());
        let digest = match source {
            None => recording.digest,
            Some(_) => (is_file && files.is_file(path)).then(whole).flatten(),
        };
        let is_heard = session.listener.hears_progress();
        let most = match source {
            None => Some(recording.times.len()),
            Some(_) => {
                (is_file && is_heard && files.is_file(path)).then(|| lines(files, path)).flatten()
            }
        };
        let measured = recording.measured.outputs.iter().map(Option::is_some).collect();
        let source = match source {
            Some(stream) => RowSource::Stream { stream, values: Vec::new() },
            None => RowSource::File { recording, next: 0 },
        };
        let (from, until) = (solve.from.unwrap_or(f64::NEG_INFINITY), solve.until);
        let n_inputs = dae.inputs.len();
        let until = until.unwrap_or(f64::INFINITY);
        Some(TrackRows {
            source,
            digest,
            session,
            is_strict: *strict,
            left_out: Vec::new(),
            n_left_out: 0,
            n_inputs,
            measured,
            from,
            until,
            most,
        })
    }

    /// Upper bound of the number of rows, if known and if progress is shown.
    pub(super) fn most(&self) -> Option<usize> {
        self.most
    }

    /// The timestamp of the first row, once read, if times are timestamps.
    pub(super) fn epoch(&self) -> Option<Epoch> {
        match &self.source {
            RowSource::File { recording, .. } => recording.epoch,
            RowSource::Stream { stream, .. } => stream.epoch(),
        }
    }

    /// Digest of the file; none for a stream.
    pub(super) fn digest(&self) -> Option<Sha256Digest> {
        self.digest
    }

    /// Takes the rows left out since the last call.
    pub(super) fn take_left_out(&mut self) -> Vec<UnreadableRow> {
        std::mem::take(&mut self.left_out)
    }

    /// The next row between `--from` and `--until`.
    pub(super) fn next(&mut self) -> Result<Option<TrackRow>, WorkError> {
        loop {
            let row = match &mut self.source {
                RowSource::File { recording, next } => {
                    let k = *next;
                    *next += 1;
                    recording.times.get(k).map(|t| TrackRow {
                        t: *t,
                        u: recording.inputs_at(k),
                        measured: (recording.measured.outputs.iter())
                            .map(|samples| samples.as_ref().map_or(f64::NAN, |samples| samples[k]))
                            .collect(),
                    })
                }
                RowSource::Stream { stream, values } => {
                    let t = match stream.next(values) {
                        Err(fault) if !(fault.is_end || self.is_strict) => {
                            self.session.remark(format!("{fault}; the row is left out"));
                            self.n_left_out += 1;
                            self.left_out
                                .push(UnreadableRow { line: fault.line, reason: fault.what });
                            continue;
                        }
                        read => read.map_err(UnusableFile::Row)?,
                    };
                    t.map(|t| TrackRow {
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

/// Number of lines of a file: rows, and a few more.
fn lines(files: &dyn FileSystem, path: &Path) -> Option<usize> {
    let mut text = data::decompressed(files.open(path).ok()?).ok()?;
    let (mut lines, mut line) = (0, Vec::new());
    while text.read_until(b'\n', &mut line).ok()? > 0 {
        lines += 1;
        line.clear();
    }
    Some(lines)
}

/// Whether a regular file begins like Parquet, which is not read row by row.
fn is_parquet(files: &dyn FileSystem, path: &Path) -> bool {
    let mut magic = [0; 4];
    files.is_file(path)
        && files.open(path).is_ok_and(|mut file| file.read_exact(&mut magic).is_ok())
        && magic == *b"PAR1"
}
