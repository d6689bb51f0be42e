//! Diagnostics as text for people, and as fields for other programs.
//!
//! Only this file uses the drawing crate.

use std::fmt::Write as _;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use super::{Diagnostic, DiagnosticLabel, visible};
use crate::sentence::argument::{Argument, Spelling, neutral};
use crate::source::{SourceId, SourceMap, Span};

/// Number of diagnostics drawn in full; the rest are counted.
const SHOWN: usize = 20;

/// Whether to draw in colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RenderStyle {
    /// Plain characters.
    Plain,
    /// ANSI escapes.
    Coloured,
}

/// Draws diagnostics in the style of rustc, each followed by an empty line.
///
/// At most twenty are drawn; a last line counts the rest.
pub fn render(diagnostics: &[&Diagnostic], sources: &SourceMap, style: RenderStyle) -> String {
    render_spelled(diagnostics, sources, style, neutral)
}

/// [`render`] with the arguments as a face writes them.
pub fn render_spelled(
    diagnostics: &[&Diagnostic],
    sources: &SourceMap,
    style: RenderStyle,
    spelling: Spelling,
) -> String {
    let renderer = renderer(style);
    let mut out = String::new();
    for diagnostic in diagnostics.iter().take(SHOWN) {
        out.push_str(&renderer.render(&[group(diagnostic, Level::ERROR, sources, spelling)]));
        out.push_str("\n\n");
    }
    if diagnostics.len() > SHOWN {
        let _ = writeln!(out, "… and {} more", diagnostics.len() - SHOWN);
    }
    out
}

/// Draws a note that is not an error.
pub fn render_note(
    diagnostic: &Diagnostic,
    sources: &SourceMap,
    style: RenderStyle,
    spelling: Spelling,
) -> String {
    renderer(style).render(&[group(diagnostic, Level::NOTE, sources, spelling)])
}

fn renderer(style: RenderStyle) -> Renderer {
    match style {
        RenderStyle::Plain => Renderer::plain(),
        RenderStyle::Coloured => Renderer::styled(),
    }
}

fn group<'a>(
    diagnostic: &'a Diagnostic,
    level: Level<'static>,
    sources: &'a SourceMap,
    spelling: Spelling,
) -> Group<'a> {
    let mut group = level
        .primary_title(visible(&diagnostic.message))
        .id(diagnostic.code.to_string())
        .elements(snippets(&diagnostic.labels, sources, spelling));
    if let Some(help) = help(diagnostic, sources, spelling) {
        group = group.element(Level::HELP.message(visible(&help).into_owned()));
    }
    group
}

/// The help text, or else the corrected line.
fn help(diagnostic: &Diagnostic, sources: &SourceMap, spelling: Spelling) -> Option<String> {
    let line = || diagnostic.fix.as_ref()?.line(sources).map(|line| format!("write `{line}`"));
    diagnostic.help.as_ref().map(|help| help.spelled(spelling)).or_else(line)
}

/// One snippet per source, the main place's first.
fn snippets<'a>(
    labels: &'a [DiagnosticLabel],
    sources: &'a SourceMap,
    spelling: Spelling,
) -> Vec<Snippet<'a, annotate_snippets::Annotation<'a>>> {
    let mut order: Vec<SourceId> = Vec::new();
    for label in labels {
        if !order.contains(&label.span.source) {
            order.push(label.span.source);
        }
    }
    order
        .into_iter()
        .map(|id| {
            let source = sources.get(id);
            let labels_here =
                || labels.iter().enumerate().filter(move |(_, l)| l.span.source == id);
            let ranges: Vec<Range<usize>> =
                labels_here().map(|(_, label)| drawable(&source.text, label.span)).collect();
            let lines = lines_around(&source.text, &ranges);
            let first_line = source.text[..lines.start].matches('\n').count() + 1;

            let mut snippet = Snippet::source(&source.text[lines.clone()])
                .line_start(first_line)
                .path(visible(&sources.shown_name(id, spelling)).into_owned());
            for ((i, label), range) in labels_here().zip(ranges) {
                let kind = if i == 0 { AnnotationKind::Primary } else { AnnotationKind::Context };
                let text = (!label.text.is_empty()).then(|| visible(&label.text));
                let range = range.start - lines.start..range.end - lines.start;
                snippet = snippet.annotation(kind.span(range).label(text));
            }
            snippet
        })
        .collect()
}

/// The whole lines that contain all ranges, so that the rest of a large file is not processed.
fn lines_around(text: &str, ranges: &[Range<usize>]) -> Range<usize> {
    let start = ranges.iter().map(|range| range.start).min().unwrap_or(0);
    let end = ranges.iter().map(|range| range.end).max().unwrap_or(0);
    let start = text[..start].rfind('\n').map_or(0, |at| at + 1);
    start..text[end..].find('\n').map_or(text.len(), |length| end + length)
}

/// The part of a span that can be underlined: within its first line, and at least one character wide if the line is not
/// empty.
fn drawable(text: &str, span: Span) -> Range<usize> {
    let start = floor(text, span.start as usize);
    let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
    let line_end = text[start..].find('\n').map_or(text.len(), |length| start + length);
    let line_end = line_start + text[line_start..line_end].trim_end_matches('\r').len();

    // A place after the last character is shown under that character.
    let last = text[line_start..line_end].char_indices().next_back();
    let start = last.map_or(line_start, |(at, _)| start.min(line_start + at));
    let width = text[start..line_end].chars().next().map_or(0, char::len_utf8);
    let end = floor(text, (span.end as usize).min(line_end)).max(start + width);
    start..end
}

/// The nearest boundary between characters at or before a byte.
fn floor(text: &str, mut at: usize) -> usize {
    at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// A diagnostic with its places resolved, for JSON and editors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DiagnosticEntry {
    /// The code, e.g. `E301`.
    pub code: String,
    /// The message.
    pub message: String,
    /// Relevant places, the main one first.
    pub places: Vec<EditorLocation>,
    /// The help text.
    pub help: Option<String>,
    /// The correction as edits.
    pub fix: Option<FixEntry>,
}

/// A fix with its places resolved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FixEntry {
    /// Whether it can be applied without confirmation.
    pub is_safe: bool,
    /// The replaced places, with the new text as `text`.
    pub edits: Vec<EditorLocation>,
}

/// A location in an editor's numbering: lines and columns from 1, columns in characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EditorLocation {
    /// Name of the source.
    pub file: String,
    /// The argument that the source is the value of, if it is not a file.
    pub argument: Option<Argument>,
    /// Line of the first character.
    pub line: usize,
    /// Column of the first character.
    pub column: usize,
    /// Line of the end.
    pub end_line: usize,
    /// Column one past the last character.
    pub end_column: usize,
    /// A note; may be empty.
    pub text: String,
}

/// The fields of a diagnostic.
pub fn entry(diagnostic: &Diagnostic, sources: &SourceMap, spelling: Spelling) -> DiagnosticEntry {
    let place = |span: Span, text: &str| {
        let end = Span { start: span.end, ..span };
        let (line, column) = sources.line_column(span);
        let (end_line, end_column) = sources.line_column(end);
        let file = sources.shown_name(span.source, spelling).into_owned();
        let argument = sources.argument(span.source);
        EditorLocation { file, argument, line, column, end_line, end_column, text: text.to_owned() }
    };
    let fix = diagnostic.fix.as_ref().map(|fix| FixEntry {
        is_safe: fix.is_safe(),
        edits: fix.edits.iter().map(|edit| place(edit.span, &edit.text)).collect(),
    });
    DiagnosticEntry {
        code: diagnostic.code.to_string(),
        message: diagnostic.message.clone(),
        places: diagnostic.labels.iter().map(|label| place(label.span, &label.text)).collect(),
        help: help(diagnostic, sources, spelling),
        fix,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::Code;
    use crate::source::SourceText;

    fn sources(text: &str) -> SourceMap {
        let mut sources = SourceMap::default();
        sources.add(SourceText { name: "tank.dgd".into(), text: text.into() });
        sources
    }

    fn span_between(start: usize, end: usize) -> Span {
        Span { source: SourceId(0), start: start as u32, end: end as u32 }
    }

    #[test]
    fn a_diagnostic_shows_place_labels_and_help() {
        let sources = sources("let a = 3 [m]\nlet b = a + 2 [s]\n");
        let diagnostic =
            Diagnostic::new(Code::IncompatibleUnits, span_between(26, 31), "cannot add m and s")
                .here("has unit s")
                .label(span_between(22, 23), "has unit m")
                .help("divide by a time first");
        assert_eq!(
            render(&[&diagnostic], &sources, RenderStyle::Plain),
            "\
error[E301]: cannot add m and s
 --> tank.dgd:2:13
  |
2 | let b = a + 2 [s]
  |         -   ^^^^^ has unit s
  |         |
  |         has unit m
  |
  = help: divide by a time first

"
        );
        let entry = entry(&diagnostic, &sources, neutral);
        assert_eq!((entry.places[0].line, entry.places[0].column), (2, 13));
        assert_eq!((entry.places[0].end_line, entry.places[0].end_column), (2, 18));
    }

    #[test]
    fn places_at_the_end_of_a_line_or_file_stay_within_it() {
        for (text, start, end, expected) in [
            ("let a =\nlet b", 7, 7, 6..7),
            ("let a =\nlet b", 7, 9, 6..7),
            ("let a =\r\nlet b", 7, 8, 6..7),
            ("let b", 5, 5, 4..5),
            ("let b", 9, 12, 4..5),
            ("a\n\nb", 2, 2, 2..2),
            ("é", 1, 1, 0..2),
            ("", 0, 0, 0..0),
            ("one\ntwo", 1, 6, 1..3),
        ] {
            assert_eq!(drawable(text, span_between(start, end)), expected, "{text:?}");
            let sources = sources(text);
            let span = span_between(start.min(text.len()), end.min(text.len()));
            let drawn = render(
                &[&Diagnostic::new(Code::UnexpectedToken, span, "x")],
                &sources,
                RenderStyle::Plain,
            );
            assert!(drawn.contains("--> tank.dgd:"), "{drawn}");
        }
    }

    #[test]
    fn a_long_line_is_cut_around_the_place() {
        let text = format!("let a = {}; {}", "b + ".repeat(2500), "c + ".repeat(2500));
        let sources = sources(&text);
        let diagnostic = Diagnostic::new(
            Code::UnexpectedCharacter,
            span_between(10_008, 10_009),
            "unexpected character",
        );
        let drawn = render(&[&diagnostic], &sources, RenderStyle::Plain);
        assert!(drawn.contains("tank.dgd:1:10009"), "{drawn}");
        assert!(drawn.lines().all(|line| line.chars().count() < 200), "{drawn}");
        assert!(drawn.contains(';'));
    }

    #[test]
    fn nothing_in_a_diagnostic_is_obeyed_by_a_terminal() {
        let mut sources = SourceMap::default();
        sources
            .add(SourceText { name: "a\u{202e}.dgd".into(), text: "le\u{202e}t \u{1b}[2J".into() });
        let diagnostic =
            Diagnostic::new(Code::UnexpectedToken, span_between(0, 2), "wrong \u{202e}")
                .here("\u{1b}[2J")
                .help("is `\u{2066}` meant?");
        let drawn = render(&[&diagnostic], &sources, RenderStyle::Plain);
        let obeyed =
            |c: char| (c.is_control() && c != '\n') || ('\u{202a}'..='\u{2069}').contains(&c);
        assert!(!drawn.contains(obeyed), "{drawn:?}");
        for part in ["wrong \\u{202e}", "a\\u{202e}.dgd", "\\u{1b}[2J", "is `\\u{2066}` meant?"] {
            assert!(drawn.contains(part), "{drawn}");
        }
    }

    #[test]
    fn what_is_beyond_the_limit_is_counted() {
        let sources = sources("x");
        let diagnostic = Diagnostic::new(Code::UnexpectedToken, span_between(0, 1), "wrong");
        let all = vec![&diagnostic; SHOWN + 3];
        let drawn = render(&all, &sources, RenderStyle::Plain);
        assert_eq!(drawn.matches("error[E105]").count(), SHOWN);
        assert!(drawn.ends_with("… and 3 more\n"));
    }
}
