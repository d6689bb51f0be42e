//! Reads a file: its text, its header and its rows.

use std::io::{self, BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::source::{SourceMap, SourceText, Span};

#[cfg(feature = "parquet")]
use crate::csv::groups;
use crate::csv::header::CsvHeader;
use crate::csv::kept::ShownText;
use crate::csv::numbers;
use crate::csv::records::CsvRecords;
use crate::csv::rename::Rename;
use crate::csv::rows::CsvRows;
use crate::encoding::{NotText, not_text};
use crate::open::{DiskFiles, FileSystem, STANDARD_INPUT};
use crate::parquet::{MAGIC, RandomAccess};
use crate::sha256::{DigestingReader, Sha256Digest};
use crate::table::{DataTable, DisorderPolicy};

/// Bytes of text kept so that a diagnostic can show its line. For a longer text only the lines down to the header are
/// kept, and the diagnostic gives the line number.
const KEPT: usize = 1 << 22;

/// Options for reading a data file: CSV, possibly compressed with gzip, or Parquet.
#[derive(Debug, Clone, Copy)]
pub struct ReadOptions<'a> {
    /// Bytes of text kept for diagnostics.
    pub(crate) kept: usize,
    pub(crate) order: DisorderPolicy,
    pub(crate) renames: &'a [Rename],
    /// Names of the columns to read; `None` for all.
    pub(crate) wanted: Option<&'a [&'a str]>,
}

impl Default for ReadOptions<'_> {
    fn default() -> Self {
        ReadOptions { kept: KEPT, order: DisorderPolicy::Required, renames: &[], wanted: None }
    }
}

impl<'a> ReadOptions<'a> {
    /// The same, with other names for some columns.
    #[must_use]
    pub fn renamed(self, renames: &'a [Rename]) -> Self {
        ReadOptions { renames, ..self }
    }

    /// The same where times may be out of order: rows whose time runs backwards are left out and reported in
    /// [`DataTable::disorder`].
    #[must_use]
    pub fn as_it_is(self) -> Self {
        ReadOptions { order: DisorderPolicy::Recorded, ..self }
    }

    /// The same with only these columns and the time; other columns get a header and no values.
    #[must_use]
    pub fn with_columns(self, wanted: &'a [&'a str]) -> Self {
        ReadOptions { wanted: Some(wanted), ..self }
    }

    /// Whether a column of this name is read.
    pub(crate) fn wants(self, name: &str) -> bool {
        self.wanted.is_none_or(|wanted| wanted.contains(&name))
    }

    /// Reads a data file.
    pub fn read(
        self,
        files: &dyn FileSystem,
        path: &Path,
        sources: &mut SourceMap,
        diagnostics: &mut Diagnostics,
    ) -> Result<DataTable, ErrorReported> {
        let name = if path == Path::new(STANDARD_INPUT) {
            "standard input".to_owned()
        } else {
            path.display().to_string()
        };
        if let Some(columns) = files.columns(path) {
            return numbers::read(&columns, &name, self, sources, diagnostics);
        }
        // A file on disk is read by columns, and never loaded as a whole.
        let place = files.file(path).map(RandomAccess::File);
        if let Some(place) = place.filter(RandomAccess::is_parquet) {
            return read_parquet(self, &name, place, sources, diagnostics);
        }
        match files.open(path) {
            Ok(file) => read_with(self, &name, file, sources, diagnostics),
            Err(why) => Err(diagnostics.error(unreadable(&name, "", sources, &why))),
        }
    }
}

/// Reads a data file on disk.
pub fn read(
    path: &Path,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    ReadOptions::default().read(&DiskFiles, path, sources, diagnostics)
}

/// Reads a data file from any source, called `name` in diagnostics.
pub fn read_from(
    name: &str,
    input: impl Read,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    read_with(ReadOptions::default(), name, input, sources, diagnostics)
}

pub(crate) fn read_with(
    reading: ReadOptions<'_>,
    name: &str,
    input: impl Read,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    let mut input = DigestingReader::new(input);
    let mut table = read_text(reading, name, &mut input, sources, diagnostics)?;
    table.digest = Some(input.digest());
    Ok(table)
}

fn read_text(
    reading: ReadOptions<'_>,
    name: &str,
    input: impl Read,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    let ReadOptions { kept: limit, renames, .. } = reading;
    let mut head = Vec::new();
    let opened = decompressed(input).and_then(|mut input| {
        (&mut input).take(limit as u64).read_to_end(&mut head)?;
        if head.starts_with(MAGIC) {
            // Only its end distinguishes a Parquet file from a text with the same first letters.
            input.read_to_end(&mut head)?;
        }
        Ok(input)
    });
    let mut rest = match opened {
        Ok(rest) => rest,
        Err(error) => {
            return Err(diagnostics.error(unreadable(name, "", sources, &error.to_string())));
        }
    };
    if head.starts_with(MAGIC) {
        if head.ends_with(MAGIC) {
            return parquet_columns(
                RandomAccess::Memory(head),
                name,
                reading,
                sources,
                diagnostics,
            );
        }
        rest = Box::new(Cursor::new(head.split_off(limit.min(head.len()))));
    }
    let whole = head.len() < limit;
    let head = head.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&head);
    let text = match utf8(head, whole) {
        Ok(text) => text,
        Err((valid, why)) => {
            let diagnostic = unreadable(name, valid, sources, why.message).help(why.help);
            return Err(diagnostics.error(diagnostic));
        }
    };

    // Down to the header line.
    let (mut start, mut lines) = (0, 0);
    for line in text.split_inclusive('\n') {
        if !(line.trim().is_empty() || line.starts_with('#')) {
            break;
        }
        start += line.len();
        lines += 1;
    }
    let mut records = CsvRecords::new(Cursor::new(&head[start..]).chain(rest), start, lines);
    let mut header = match records.next() {
        Ok(Some(record)) if record.end() <= text.len() => CsvHeader::from_record(&record),
        Ok(_) => {
            let why = if text.trim().is_empty() { "it is empty" } else { "it has no header line" };
            return Err(diagnostics.error(unreadable(name, &text[..start], sources, why)));
        }
        Err(error) => {
            return Err(diagnostics.error(unreadable(name, "", sources, &error.to_string())));
        }
    };
    let shown = if whole { text } else { &text[..header.place.end] };
    let source = sources.add(SourceText { name: name.to_owned(), text: shown.to_owned() });

    let kept = ShownText { source, whole };
    header.rename(renames, kept, sources, diagnostics)?;
    let mut rows = CsvRows::below(&header, reading, kept, sources, diagnostics)?;
    loop {
        match records.next() {
            Ok(Some(record)) => rows.take(&record),
            Ok(None) => return rows.finish(diagnostics),
            Err(error) => {
                let message = format!("`{name}` breaks off after {} rows: {error}", rows.len());
                let place = rows.header();
                return Err(diagnostics.error(Diagnostic::new(
                    Code::UnreadableFile,
                    place,
                    message,
                )));
            }
        }
    }
}

/// The bytes of a file, decompressed if they are a gzip stream.
///
/// # Errors
///
/// Those of reading.
pub fn decompressed<'a>(mut input: impl Read + 'a) -> io::Result<Box<dyn BufRead + 'a>> {
    let mut magic = Vec::new();
    (&mut input).take(2).read_to_end(&mut magic)?;
    let gzip = magic == [0x1f, 0x8b];
    let input = Cursor::new(magic).chain(input);
    Ok(if gzip {
        Box::new(BufReader::new(flate2::read::MultiGzDecoder::new(BufReader::new(input))))
    } else {
        Box::new(BufReader::new(input))
    })
}

/// Reads a Parquet file on disk.
fn read_parquet(
    reading: ReadOptions<'_>,
    name: &str,
    mut place: RandomAccess,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    let digest = match &mut place {
        RandomAccess::File(file) => file.rewind().and_then(|()| Sha256Digest::read(file)),
        RandomAccess::Memory(bytes) => Sha256Digest::read(bytes.as_slice()),
    };
    let digest = digest
        .map_err(|error| diagnostics.error(unreadable(name, "", sources, &error.to_string())))?;
    let table = parquet_columns(place, name, reading, sources, diagnostics)?;
    Ok(DataTable { digest: Some(digest), ..table })
}

#[cfg(feature = "parquet")]
use groups::read as parquet_columns;

/// Refuses a Parquet file.
#[cfg(not(feature = "parquet"))]
fn parquet_columns(
    _: RandomAccess,
    name: &str,
    _: ReadOptions<'_>,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    let refusal = unreadable(name, "", sources, "it is Parquet, which this build does not read");
    let help = "write it as `.csv`, or build dgd with its feature `parquet`";
    Err(diagnostics.error(refusal.help(help)))
}

/// The bytes as text; for the head of a longer text, without a split character at the end. Otherwise the text before
/// the first invalid byte.
fn utf8(head: &[u8], whole: bool) -> Result<&str, (&str, NotText)> {
    // A truncated Parquet file gets its own message below.
    if let Some(why) = not_text(head).filter(|_| !head.starts_with(MAGIC)) {
        return Err(("", why));
    }
    str::from_utf8(head).or_else(|error| {
        let valid = str::from_utf8(&head[..error.valid_up_to()]).unwrap_or_default();
        if !whole && error.error_len().is_none() {
            return Ok(valid);
        }
        let why = if head.starts_with(MAGIC) {
            NotText { message: "it is a Parquet file without its end", help: "copy it again" }
        } else {
            NotText { message: "this is not UTF-8 text", help: "save it as UTF-8" }
        };
        Err((valid, why))
    })
}

/// A file that cannot be opened.
pub fn cannot_read(name: &str, sources: &mut SourceMap, why: &str) -> Diagnostic {
    unreadable(name, "", sources, why)
}

/// A file that is not the text of a table, with its valid beginning.
pub(crate) fn unreadable(name: &str, text: &str, sources: &mut SourceMap, why: &str) -> Diagnostic {
    let end = u32::try_from(text.len()).unwrap_or(u32::MAX);
    let source = sources.add(SourceText { name: name.to_owned(), text: text.to_owned() });
    let span = Span { source, start: end, end };
    Diagnostic::new(Code::UnreadableFile, span, format!("cannot read `{name}`: {why}"))
}
