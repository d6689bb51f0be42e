//! What goes to the terminal: results, remarks and mistakes.

use std::io::{self, IsTerminal, Write};
use std::path::Path;

use dgd_compiler::diagnostics::fix::written;
use dgd_compiler::diagnostics::{Diagnostic, Fix, render, visible};
use dgd_compiler::source::{Source, SourceId, Sources};
use dgd_data::files::write_whole;
use dgd_identify::{Progress, Watch};
use dgd_work::{Listener, Mistake, Remark, Session, WorkError, json_text};
use serde_json::{Value, json};

use crate::args::{Color, Format, Global};
use crate::command_line;
use crate::failure::CommandError;
use crate::table_file::TableFormat;
use crate::targets::Targets;

/// Standard output and standard error, as the global options want them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console<'a> {
    global: &'a Global,
    /// What is written, where that was found.
    targets: Option<&'a Targets>,
    /// Whether programs read line after line, each of them JSON, and not one document.
    in_lines: bool,
}

impl<'a> Console<'a> {
    pub(crate) fn new(global: &'a Global) -> Self {
        Console { global, targets: None, in_lines: false }
    }

    /// For a command that writes these.
    pub(crate) fn writing(self, targets: &'a Targets) -> Self {
        Console { targets: Some(targets), ..self }
    }

    /// Checks that nothing takes the place of a file that was read.
    pub(crate) fn spare(self, sources: &Sources) -> Result<(), WorkError> {
        self.targets.map_or(Ok(()), |targets| targets.spare(sources))
    }

    /// Who asks for work that nobody stops on its way.
    pub(crate) fn session(&self) -> Session<'_> {
        Session::new(self).with_seed(self.seed()).with_threads(self.threads())
    }

    /// For programs that read line after line.
    pub(crate) fn in_lines(self) -> Self {
        Console { in_lines: true, ..self }
    }

    pub(crate) fn is_json(self) -> bool {
        self.global.format == Format::Json
    }

    /// Whether the result is JSON: it is asked for, or its file is called so.
    pub(crate) fn writes_json(self) -> bool {
        let is_called = |path: &Path| path.extension().is_some_and(|ending| ending == "json");
        self.is_json() || self.out().is_some_and(is_called)
    }

    /// Whether anybody gets the whole result as JSON.
    pub(crate) fn needs_json(self) -> bool {
        let is_document = |path| self.table_format(path).is_ok_and(TableFormat::is_document);
        self.is_json() || self.out().is_some_and(is_document)
    }

    /// What a table is written as to `--out`.
    pub(crate) fn table_format(self, path: &Path) -> Result<TableFormat, CommandError> {
        TableFormat::of(path, self.global.format)
    }

    /// Writes the result to `--out`, whole or not at all, or to standard output.
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

    /// Threads for what runs many simulations.
    pub(crate) fn threads(self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        self.global.threads.unwrap_or_else(all)
    }

    /// Most memory, bytes, where the command line says so.
    pub(crate) fn memory_asked(self) -> Option<u64> {
        self.global.memory
    }

    /// Threads, where the command line says so.
    pub(crate) fn threads_asked(self) -> Option<usize> {
        self.global.threads
    }

    /// Says something about the run on standard error, unless told to be quiet.
    pub(crate) fn remark(self, text: &str) {
        if !self.global.quiet {
            complain(&visible(text));
        }
    }

    /// Shows a diagnostic that is not an error.
    pub(crate) fn note(self, diagnostic: &Diagnostic, sources: &Sources) {
        if !self.global.quiet {
            // Drawn with escapes of its own, and none of another.
            complain(render::render_note(diagnostic, sources, self.style()).trim_end());
        }
    }

    /// Shows why a command did not succeed: to people on standard error, to programs where they
    /// look for the result.
    pub(crate) fn failure(self, error: &CommandError) {
        match error {
            CommandError::Diagnosed { diagnostics, sources } if self.is_json() => {
                let entries: Vec<Value> = diagnostics
                    .iter()
                    .map(|diagnostic| json!(Mistake::of(diagnostic, sources)))
                    .collect();
                self.print_or_complain(&json!({ "diagnostics": entries }));
            }
            CommandError::Diagnosed { diagnostics, sources } => {
                let all: Vec<&Diagnostic> = diagnostics.iter().collect();
                complain(render::render(&all, sources, self.style()).trim_end());
                if let Some(words) = mended(diagnostics, sources) {
                    self.remark(&words);
                }
            }
            // The user knows: the result says so as well.
            CommandError::Interrupted(message) => self.remark(message),
            CommandError::Found(message)
            | CommandError::Shown(message)
            | CommandError::Usage(message)
            | CommandError::Computation(message)
            | CommandError::Stopped(message) => {
                let shown = visible(message);
                // The result that was written says why, and there is one result.
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

    /// Prints to standard output, or complains where that is not possible.
    fn print_or_complain(self, value: &Value) {
        let text = if self.in_lines { format!("{value}\n") } else { json_text(value) };
        if let Err(error) = print(&text) {
            complain(&error.to_string());
        }
    }

    fn style(self) -> render::Style {
        if self.is_coloured() { render::Style::Coloured } else { render::Style::Plain }
    }

    fn is_coloured(self) -> bool {
        match self.global.color {
            Color::Always => true,
            Color::Never => false,
            Color::Auto => {
                let wanted = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
                wanted && io::stderr().is_terminal()
            }
        }
    }
}

impl Watch for Console<'_> {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}

impl Listener for Console<'_> {
    fn remark(&self, remark: Remark<'_>) {
        match remark {
            Remark::Words(words) => (*self).remark(words),
            Remark::Diagnostic(diagnostic, sources) => (*self).note(diagnostic, sources),
            other => (*self).remark(&other.to_text()),
        }
    }

    fn hears_remarks(&self) -> bool {
        !self.is_quiet()
    }

    fn has_read(&self, sources: &Sources) -> Result<(), WorkError> {
        self.spare(sources)
    }
}

/// How many mistakes `dgd check --fix` mends, and of which file; nothing where that is none.
fn mended(diagnostics: &[Diagnostic], sources: &Sources) -> Option<String> {
    let fixes = diagnostics.iter().filter_map(|diagnostic| diagnostic.fix.as_ref());
    let fixes: Vec<&Fix> = fixes.filter(|fix| fix.is_safe()).collect();
    let of_file = |(k, source): (usize, &Source)| {
        let (_, n) = written(&source.text, SourceId(u32::try_from(k).ok()?), &fixes);
        (n > 0 && Path::new(&source.name).is_file()).then(|| (source.name.clone(), n))
    };
    let (file, n) = sources.iter().enumerate().find_map(of_file)?;
    let what = match (n, diagnostics.len()) {
        (1, 1) => "this mistake".to_owned(),
        (n, all) if n == all => format!("these {n} mistakes"),
        (n, all) => format!("{n} of these {all} mistakes"),
    };
    Some(format!("`dgd check {file} --fix` mends {what}"))
}

/// Prints what people read to standard output, with nothing in it that a terminal would obey.
pub(crate) fn print_text(text: &str) -> Result<(), CommandError> {
    print(&visible(text))
}

/// Prints to standard output; a reader that went away is not an error.
pub(crate) fn print(text: &str) -> Result<(), CommandError> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(CommandError::Found(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Says why the program is about to end, where programs look for it or on standard error.
pub(crate) fn last_words(message: &str) {
    if command_line::wants_json() {
        // Where the reader went away, the exit code still says it.
        let _ = print(&format!("{}\n", json!({ "error": message })));
    } else {
        complain(&format!("error: {}", visible(message)));
    }
}

/// Prints a line to standard error; there is nowhere to report that this failed.
pub(crate) fn complain(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
