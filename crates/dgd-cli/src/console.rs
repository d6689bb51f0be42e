//! Terminal output: results, remarks and mistakes.

use std::io::{self, IsTerminal, Write};
use std::path::Path;

use dgd_compiler::diagnostics::fix::written;
use dgd_compiler::diagnostics::{Diagnostic, Fix, render, visible};
use dgd_compiler::source::{SourceId, SourceMap, SourceText};
use dgd_data::files::write_whole;
use dgd_data::write::TableFormat;
use dgd_identify::{Monitor, Progress};
use dgd_work::{Mistake, Remark, Reporter, Spelling, TaskContext, WorkError, json_text};
use serde_json::{Value, json};

use crate::args::{ColorChoice, GlobalArgs, OutputFormat};
use crate::command_line::{self, option};
use crate::failure::CommandError;
use crate::table_file;
use crate::targets::OutputTargets;

/// Standard output and standard error, configured by the global options.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console<'a> {
    global: &'a GlobalArgs,
    /// The files to be written, if already determined.
    targets: Option<&'a OutputTargets>,
    /// Whether the output is JSON lines instead of one document.
    in_lines: bool,
}

impl<'a> Console<'a> {
    pub(crate) fn new(global: &'a GlobalArgs) -> Self {
        Console { global, targets: None, in_lines: false }
    }

    /// The console of a command that writes these files.
    pub(crate) fn writing(self, targets: &'a OutputTargets) -> Self {
        Console { targets: Some(targets), ..self }
    }

    /// Checks that no output would replace a file that was read.
    pub(crate) fn spare(self, sources: &SourceMap) -> Result<(), WorkError> {
        self.targets.map_or(Ok(()), |targets| targets.spare(sources))
    }

    /// A session without progress or cancellation.
    pub(crate) fn session(&self) -> TaskContext<'_> {
        TaskContext::new(self).with_seed(self.seed()).with_threads(self.threads())
    }

    /// The console for programs that read JSON lines.
    pub(crate) fn in_lines(self) -> Self {
        Console { in_lines: true, ..self }
    }

    pub(crate) fn is_json(self) -> bool {
        self.global.format == OutputFormat::Json
    }

    /// Whether the result is JSON, by option or by the name of its file.
    pub(crate) fn writes_json(self) -> bool {
        let is_called = |path: &Path| path.extension().is_some_and(|ending| ending == "json");
        self.is_json() || self.out().is_some_and(is_called)
    }

    /// Whether the whole result is needed as JSON.
    pub(crate) fn needs_json(self) -> bool {
        let is_document = |path| self.table_format(path).is_ok_and(TableFormat::is_document);
        self.is_json() || self.out().is_some_and(is_document)
    }

    /// The format of a table written to `--out`.
    pub(crate) fn table_format(self, path: &Path) -> Result<TableFormat, CommandError> {
        table_file::table_format(path, self.global.format)
    }

    /// Writes the result to `--out`, atomically, or to standard output.
    pub(crate) fn result(self, text: &str) -> Result<(), CommandError> {
        match self.out() {
            Some(_) => self.write(text),
            None => print_text(text),
        }
    }

    fn write(self, text: &str) -> Result<(), CommandError> {
        match self.out() {
            Some(path) => Ok(write_whole(path, |out| out.write_all(text.as_bytes()))?),
            None => print(text),
        }
    }

    /// Writes a result as JSON, as [`Console::result`].
    pub(crate) fn json(self, value: &Value) -> Result<(), CommandError> {
        self.write(&json_text(value))
    }

    pub(crate) fn out(self) -> Option<&'a Path> {
        self.global.out.as_deref()
    }

    pub(crate) fn is_quiet(self) -> bool {
        self.global.quiet
    }

    /// Seed of everything random.
    pub(crate) fn seed(self) -> u64 {
        self.global.seed
    }

    /// Threads for many simulations.
    pub(crate) fn threads(self) -> usize {
        let processors = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        self.global.threads.unwrap_or_else(processors)
    }

    /// The memory limit in bytes, if given on the command line.
    pub(crate) fn memory_asked(self) -> Option<u64> {
        self.global.memory
    }

    /// The number of threads, if given on the command line.
    pub(crate) fn threads_asked(self) -> Option<usize> {
        self.global.threads
    }

    /// Prints a remark to standard error, except with `--quiet`.
    pub(crate) fn remark(self, text: &str) {
        if !self.global.quiet {
            complain(&visible(text));
        }
    }

    /// Prints a diagnostic that is not an error.
    pub(crate) fn note(self, diagnostic: &Diagnostic, sources: &SourceMap) {
        if !self.global.quiet {
            // The diagnostic is drawn with its own escapes, and others are removed.
            complain(render::render_note(diagnostic, sources, self.style(), option).trim_end());
        }
    }

    /// Reports the failure of a command: as text on standard error, or as JSON with the result.
    pub(crate) fn failure(self, error: &CommandError) {
        match error {
            CommandError::Diagnosed { diagnostics, sources } if self.is_json() => {
                let entries: Vec<Value> = diagnostics
                    .iter()
                    .map(|diagnostic| json!(Mistake::from_diagnostic(diagnostic, sources, option)))
                    .collect();
                self.print_or_complain(&json!({ "diagnostics": entries }));
            }
            CommandError::Diagnosed { diagnostics, sources } => {
                let sorted: Vec<&Diagnostic> = diagnostics.iter().collect();
                let drawn = render::render_spelled(&sorted, sources, self.style(), option);
                complain(drawn.trim_end());
                if let Some(words) = mended(diagnostics, sources) {
                    self.remark(&words);
                }
            }
            // The user caused it, and the result reports it.
            CommandError::Interrupted(message) => self.remark(message),
            CommandError::Found(message)
            | CommandError::Shown(message)
            | CommandError::Usage(message)
            | CommandError::Computation(message)
            | CommandError::Stopped(message) => {
                let shown = visible(message);
                // The written result contains the reason, and there must be only one document.
                let is_written = matches!(error, CommandError::Shown(_) | CommandError::Stopped(_));
                if self.is_json() && !is_written {
                    self.print_or_complain(&json!({ "error": message }));
                } else if self.is_coloured() {
                    complain(&format!("\u{1b}[1;31merror\u{1b}[0m: {shown}"));
                } else {
                    complain(&format!("error: {shown}"));
                }
            }
        }
    }

    /// Prints to standard output, or reports on standard error that it failed.
    fn print_or_complain(self, value: &Value) {
        let text = if self.in_lines { format!("{value}\n") } else { json_text(value) };
        if let Err(error) = print(&text) {
            complain(&error.to_string());
        }
    }

    fn style(self) -> render::RenderStyle {
        if self.is_coloured() { render::RenderStyle::Coloured } else { render::RenderStyle::Plain }
    }

    fn is_coloured(self) -> bool {
        match self.global.color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => {
                let wanted = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
                wanted && io::stderr().is_terminal()
            }
        }
    }
}

impl Monitor for Console<'_> {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}

impl Reporter for Console<'_> {
    fn remark(&self, remark: Remark<'_>) {
        match remark {
            Remark::Words(words) => (*self).remark(words),
            Remark::Diagnostic(diagnostic, sources) => (*self).note(diagnostic, sources),
            other => (*self).remark(&other.to_text(option)),
        }
    }

    fn spelling(&self) -> Spelling {
        option
    }

    fn hears_remarks(&self) -> bool {
        !self.is_quiet()
    }

    fn has_read(&self, sources: &SourceMap) -> Result<(), WorkError> {
        self.spare(sources)
    }
}

/// How many mistakes `dgd check --fix` can fix, and in which file; `None` without fixes.
fn mended(diagnostics: &[Diagnostic], sources: &SourceMap) -> Option<String> {
    let fixes = diagnostics.iter().filter_map(|diagnostic| diagnostic.fix.as_deref());
    let fixes: Vec<&Fix> = fixes.filter(|fix| fix.is_safe()).collect();
    let of_file = |(k, source): (usize, &SourceText)| {
        let id = SourceId(u32::try_from(k).ok()?);
        let (_, n) = written(&source.text, id, &fixes);
        let is_file = sources.argument(id).is_none() && Path::new(&source.name).is_file();
        (n > 0 && is_file).then(|| (source.name.clone(), n))
    };
    let (file, n) = sources.iter().enumerate().find_map(of_file)?;
    let what = match (n, diagnostics.len()) {
        (1, 1) => "this mistake".to_owned(),
        (n, all) if n == all => format!("these {n} mistakes"),
        (n, all) => format!("{n} of these {all} mistakes"),
    };
    Some(format!("`dgd check {file} --fix` mends {what}"))
}

/// Prints text to standard output, without control characters that a terminal would interpret.
pub(crate) fn print_text(text: &str) -> Result<(), CommandError> {
    print(&visible(text))
}

/// Prints to standard output; a closed pipe is not an error.
pub(crate) fn print(text: &str) -> Result<(), CommandError> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(CommandError::Found(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Reports why the program is about to end, as JSON or on standard error.
pub(crate) fn last_words(message: &str) {
    if command_line::wants_json() {
        // If the pipe is closed, the exit code still reports it.
        let _ = print(&format!("{}\n", json!({ "error": message })));
    } else {
        complain(&format!("error: {}", visible(message)));
    }
}

/// Prints a line to standard error; a failure cannot be reported anywhere.
pub(crate) fn complain(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
