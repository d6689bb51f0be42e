//! The canonical layout of a file: `dgd fmt`.
//!
//! Only blanks and empty lines change; tokens, comments and line breaks stay. Items are indented by two blanks for
//! every brace, continuation lines by four more. Declarations of one kind in consecutive lines are aligned in columns.
//! `*` and `/` keep their blanks or their lack of blanks because authors use them to group a formula: `rho/A * der(q)`.
//! Comments at the end of lines keep their column if the text leaves them room; those of lines that form columns share
//! one.
//!
//! Works on tokens, so that it also formats text that this version cannot compile.

use super::parse::is_keyword;
use super::parse::item_ends::item_ends;
use super::parse::lexical::{self, RESERVED, Token, TokenKind};
use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::source::{SourceId, SourceMap, SourceText};

/// Blanks per open brace.
const INDENT: usize = 2;
/// Additional blanks of a continuation line.
const CONTINUED: usize = 4;
/// Minimum number of blanks before a comment at the end of a line.
const COMMENT_GAP: usize = 2;
/// Deeper braces are not indented any further.
const DEEPEST: usize = 64;
/// Wider cells do not move the columns after them.
const WIDEST_CELL: usize = 48;

/// A text made by editing a source, formatted if the source was: an author's own layout is preserved.
pub fn like(original: SourceId, sources: &SourceMap, edited: String) -> String {
    let mut unread = Diagnostics::default();
    let was_laid_out = format(original, sources, &mut unread)
        .is_ok_and(|canonical| canonical == sources.get(original).text);
    if !was_laid_out {
        return edited;
    }
    let mut sources_of_text = SourceMap::default();
    let id = sources_of_text.add(SourceText { name: String::new(), text: edited.clone() });
    format(id, &sources_of_text, &mut unread).unwrap_or(edited)
}

/// Formats a source. Fails only if it cannot be split into tokens.
pub fn format(
    source: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<String, ErrorReported> {
    let mut problems = Diagnostics::default();
    let text = sources.get(source).text.as_str();
    let tokens = lexical::tokens(source, sources, &mut problems);
    for diagnostic in problems.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    problems.check()?;

    let mut lines = lines(text, &tokens);
    align(&mut lines);
    place_comments(&mut lines);
    Ok(joined(&lines))
}

/// A line of the source.
#[derive(Default)]
struct LayoutLine {
    /// Blanks before it.
    indent: usize,
    /// The code in cells; a line that is not in columns has one.
    cells: Vec<(ItemColumn, String)>,
    /// The group of lines that it forms columns with.
    group: Option<LineGroup>,
    /// The code after layout.
    code: String,
    /// Comment at the end, or alone.
    comment: String,
    /// Column of the comment, in characters.
    comment_column: usize,
}

/// The columns of items, from left to right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum ItemColumn {
    /// Keyword and name, or name of a choice.
    Head,
    /// The unit.
    Unit,
    /// `= …`, or what is after an equation's label, or `{ … }`.
    Value,
    /// Attributes.
    Attributes,
}

const COLUMNS: [ItemColumn; 4] =
    [ItemColumn::Head, ItemColumn::Unit, ItemColumn::Value, ItemColumn::Attributes];

/// Lines of one group form columns when they follow each other.
#[derive(Debug, Clone, PartialEq, Eq)]
enum LineGroup {
    /// Items with this keyword.
    Item(String),
    /// `NAME { … }`
    Choice,
}

/// Keywords of items that are written in columns.
const IN_COLUMNS: &[&str] = &[
    "constant",
    "parameter",
    "input",
    "state",
    "unknown",
    "held",
    "unit",
    "let",
    "function",
    "output",
    "equation",
];

/// A token with its spacing.
struct SpacedToken {
    token: Token,
    /// Whether a blank stands before it within a line.
    blank: bool,
    class: PrecedingToken,
}

fn lines(text: &str, tokens: &[Token]) -> Vec<LayoutLine> {
    let ends = item_ends(tokens, text);
    let mut lines = Vec::new();
    let mut spacing =
        Spacing { text, before: PrecedingToken::Start, open: 0, is_loop: false, reduction: None };
    let mut depth = 0_usize;
    // Whether the line continues the item of the line above.
    let mut continued = false;
    let mut line = LayoutLine::default();
    let mut code: Vec<SpacedToken> = Vec::new();
    let mut line_start = 0;

    let no_end =
        Token { kind: TokenKind::Newline, start: text.len() as u32, end: text.len() as u32 };
    for (&token, ends_item) in tokens.iter().zip(ends).chain([(&no_end, true)]) {
        match token.kind {
            TokenKind::Newline => {
                let closing =
                    code.iter().take_while(|p| p.token.kind == TokenKind::CloseBrace).count();
                let before = depth.saturating_sub(closing);
                // A parenthesis that closes an item's lines is aligned with the item.
                let closes = code.first().is_some_and(|p| p.token.kind == TokenKind::Close);
                let deeper = if continued && !closes { CONTINUED } else { 0 };
                line.indent = INDENT * before.min(DEEPEST) + deeper;
                for placed in &code {
                    match placed.token.kind {
                        TokenKind::OpenBrace => depth += 1,
                        TokenKind::CloseBrace => depth = depth.saturating_sub(1),
                        _ => {}
                    }
                }
                (line.group, line.cells) = if continued || !ends_item {
                    (None, cells(text, &code, &[]))
                } else {
                    in_columns(text, &code)
                };
                continued = !ends_item && (continued || !code.is_empty());
                if ends_item {
                    spacing.restart();
                }
                lines.push(std::mem::take(&mut line));
                code.clear();
                line_start = token.end as usize;
            }
            TokenKind::Comment | TokenKind::Doc => {
                token.text(text).trim_end().clone_into(&mut line.comment);
                line.comment_column = text[line_start..token.start as usize].chars().count();
            }
            kind => {
                let behind_brace = code.last().is_some_and(|placed| {
                    matches!(placed.token.kind, TokenKind::OpenBrace | TokenKind::CloseBrace)
                });
                let (blank, class) = spacing.place(token);
                code.push(SpacedToken { token, blank: blank || behind_brace, class });
                if matches!(kind, TokenKind::OpenBrace | TokenKind::CloseBrace) {
                    spacing.restart();
                }
            }
        }
    }
    lines
}

/// The code in cells that begin at these tokens; the first begins at token 0.
fn cells(
    text: &str,
    code: &[SpacedToken],
    starts: &[(ItemColumn, usize)],
) -> Vec<(ItemColumn, String)> {
    let mut cells: Vec<(ItemColumn, String)> = Vec::new();
    for (i, placed) in code.iter().enumerate() {
        let start = starts.iter().find(|(_, start)| *start == i).map(|(column, _)| *column);
        match (start, cells.last_mut()) {
            (Some(column), _) => cells.push((column, placed.token.text(text).to_owned())),
            (None, None) => cells.push((ItemColumn::Head, placed.token.text(text).to_owned())),
            (None, Some((_, cell))) => {
                if placed.blank {
                    cell.push(' ');
                }
                cell.push_str(placed.token.text(text));
            }
        }
    }
    cells
}

/// The cells of a line that is an item, and its group.
fn in_columns(text: &str, code: &[SpacedToken]) -> (Option<LineGroup>, Vec<(ItemColumn, String)>) {
    let kind = |i: usize| code.get(i).map(|placed: &SpacedToken| placed.token.kind);
    let word = |i: usize| code.get(i).map_or("", |placed| placed.token.text(text));

    let is_brace =
        |p: &&SpacedToken| matches!(p.token.kind, TokenKind::OpenBrace | TokenKind::CloseBrace);
    if kind(0) == Some(TokenKind::Name) && kind(1) == Some(TokenKind::OpenBrace) {
        let is_one_line = kind(code.len() - 1) == Some(TokenKind::CloseBrace);
        let group = is_one_line.then_some(LineGroup::Choice);
        return (group, cells(text, code, &[(ItemColumn::Value, 1)]));
    }
    if kind(0) != Some(TokenKind::Name)
        || !IN_COLUMNS.contains(&word(0))
        || code.iter().any(|placed| is_brace(&placed))
    {
        return (None, cells(text, code, &[]));
    }

    // After the declared name, which may contain points.
    let points = (2..).step_by(2).take_while(|&i| kind(i) == Some(TokenKind::Dot)).count();
    let declared = 2 + 2 * points;
    let mut starts = Vec::new();
    let mut open = 0_usize;
    let mut last_column = ItemColumn::Head;
    let separator = if word(0) == "equation" { TokenKind::Colon } else { TokenKind::Equal };
    for (i, placed) in code.iter().enumerate() {
        let column = match placed.token.kind {
            TokenKind::Open => {
                open += 1;
                continue;
            }
            TokenKind::Close => {
                open = open.saturating_sub(1);
                continue;
            }
            TokenKind::Unit
                if (declared..i).all(|between| kind(between) == Some(TokenKind::Index)) =>
            {
                (ItemColumn::Unit, i)
            }
            kind if kind == separator && separator == TokenKind::Equal => (ItemColumn::Value, i),
            kind if kind == separator => (ItemColumn::Value, i + 1),
            TokenKind::Name
                if i > 1
                    && placed.class == PrecedingToken::Word
                    && separator == TokenKind::Equal
                    && !RESERVED.contains(&word(i)) =>
            {
                (ItemColumn::Attributes, i)
            }
            _ => continue,
        };
        let has_gap = code.get(column.1).is_some_and(|placed| placed.blank);
        if open == 0 && column.0 > last_column && has_gap {
            last_column = column.0;
            starts.push(column);
        }
    }
    (Some(LineGroup::Item(word(0).to_owned())), cells(text, code, &starts))
}

/// Writes the code of every line, in columns for consecutive lines of one group.
fn align(lines: &mut [LayoutLine]) {
    let mut rest = lines;
    while let Some(first) = rest.first() {
        let (group, indent) = (&first.group, first.indent);
        let length = match group {
            None => 1,
            Some(_) => rest.iter().take_while(|l| l.group == *group && l.indent == indent).count(),
        };
        let (run, behind) = rest.split_at_mut(length);
        write_columns(run);
        rest = behind;
    }
}

fn write_columns(run: &mut [LayoutLine]) {
    let length = |cell: &str| cell.chars().count();
    // Start of every column, and the blanks before it.
    let mut starts = [(0, 0); COLUMNS.len()];
    let mut end = 0;
    let mut has_value = false;
    for column in COLUMNS {
        let cells = run.iter().flat_map(|line| &line.cells).filter(|(c, _)| *c == column);
        let Some(width) =
            cells.map(|(_, cell)| length(cell)).map(|w| if w > WIDEST_CELL { 0 } else { w }).max()
        else {
            continue;
        };
        let gap = match column {
            ItemColumn::Head => 0,
            ItemColumn::Unit | ItemColumn::Value => 1,
            ItemColumn::Attributes => 1 + usize::from(has_value),
        };
        has_value |= column == ItemColumn::Value;
        starts[column as usize] = (end + gap, gap);
        end += gap + width;
    }
    for line in run {
        let mut code = String::new();
        for (column, cell) in &line.cells {
            let (start, gap) = starts[*column as usize];
            let column = length(&code);
            let blanks = start.saturating_sub(column).max(gap);
            code.extend(std::iter::repeat_n(' ', blanks));
            code.push_str(cell);
        }
        line.code = code;
    }
}

/// Aligns the comments at the end of consecutive lines if they were aligned or the lines form columns, at the leftmost
/// of their columns that leaves the text room.
fn place_comments(lines: &mut [LayoutLine]) {
    let is_trailing = |line: &LayoutLine| !line.code.is_empty() && !line.comment.is_empty();
    let mut rest = lines;
    while !rest.is_empty() {
        let together = |pair: &&[LayoutLine]| {
            let [a, b] = pair else { return false };
            let of_one_block = a.group.is_some() && a.group == b.group && a.indent == b.indent;
            is_trailing(a)
                && is_trailing(b)
                && (of_one_block || a.comment_column == b.comment_column)
        };
        let length = 1 + rest.windows(2).take_while(together).count();
        let (run, behind) = rest.split_at_mut(length);
        let needed = |line: &LayoutLine| line.indent + line.code.chars().count() + COMMENT_GAP;
        let needed = run.iter().map(needed).max().unwrap_or(0);
        let written = run.iter().map(|line| line.comment_column).min().unwrap_or(0);
        let column = needed.max(written);
        for line in run {
            line.comment_column = column;
        }
        rest = behind;
    }
}

/// The text of the lines, without empty lines at the start and at the end, and without consecutive ones.
fn joined(lines: &[LayoutLine]) -> String {
    let mut out = String::new();
    let mut is_pending = false;
    for line in lines {
        if line.code.is_empty() && line.comment.is_empty() {
            is_pending = !out.is_empty();
            continue;
        }
        if std::mem::take(&mut is_pending) {
            out.push('\n');
        }
        out.extend(std::iter::repeat_n(' ', line.indent));
        out.push_str(&line.code);
        if !line.comment.is_empty() {
            let column = line.indent + line.code.chars().count();
            let blanks =
                if line.code.is_empty() { 0 } else { line.comment_column.saturating_sub(column) };
            out.extend(std::iter::repeat_n(' ', blanks));
            out.push_str(&line.comment);
        }
        out.push('\n');
    }
    out
}

/// The token before another, as far as spacing is concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PrecedingToken {
    /// None: the token begins an item.
    Start,
    /// A possible left operand.
    Operand,
    /// A keyword.
    Word,
    /// A `-` that belongs to the next token.
    Sign,
    /// `*`, `/`, or the `..` of a loop: with or without blanks.
    Tight { spaced: bool },
    /// Any other token.
    Other(TokenKind),
}

/// Decides on the blank before every token, one by one.
struct Spacing<'a> {
    text: &'a str,
    before: PrecedingToken,
    /// Open parentheses.
    open: usize,
    /// Whether the item is a `for`.
    is_loop: bool,
    /// Number of open parentheses at the `for` of a sum.
    reduction: Option<usize>,
}

impl Spacing<'_> {
    /// Prepares for a new item.
    fn restart(&mut self) {
        (self.before, self.open, self.is_loop) = (PrecedingToken::Start, 0, false);
        self.reduction = None;
    }

    /// Whether a blank precedes the token, unless it begins a line; and its class for the next token.
    fn place(&mut self, token: Token) -> (bool, PrecedingToken) {
        if self.before == PrecedingToken::Start {
            self.is_loop = token.text(self.text) == "for";
        }
        if self.open > 0 && token.kind == TokenKind::Name && token.text(self.text) == "for" {
            self.reduction.get_or_insert(self.open);
        }
        let blank = self.blank(token);
        self.before = self.class(token);
        match token.kind {
            TokenKind::Open => self.open += 1,
            TokenKind::Close => self.open = self.open.saturating_sub(1),
            _ => {}
        }
        self.reduction = self.reduction.filter(|open| self.open >= *open);
        (blank, self.before)
    }

    /// Whether the current tokens are the range of an index.
    fn in_range(&self) -> bool {
        self.is_loop || self.reduction.is_some()
    }

    fn blank(&self, token: Token) -> bool {
        match (self.before, token.kind) {
            // A sign is tight only if the two cannot be read as one token.
            (PrecedingToken::Sign, kind) => !matches!(
                kind,
                TokenKind::Name | TokenKind::Number | TokenKind::Open | TokenKind::Minus
            ),
            (
                PrecedingToken::Start
                | PrecedingToken::Other(TokenKind::Open | TokenKind::Caret | TokenKind::Dot),
                _,
            )
            | (
                _,
                TokenKind::Comma
                | TokenKind::Close
                | TokenKind::Colon
                | TokenKind::Index
                | TokenKind::Prime
                | TokenKind::Caret,
            )
            | (PrecedingToken::Operand, TokenKind::Open) => false,
            (PrecedingToken::Tight { spaced }, _) => spaced,
            (_, TokenKind::Star | TokenKind::Slash | TokenKind::Dot) => self.is_spaced(token),
            (_, TokenKind::Range | TokenKind::Plus | TokenKind::Minus) if self.in_range() => {
                self.is_spaced(token)
            }
            _ => true,
        }
    }

    /// Whether the author wrote a blank on either side, or ended the line there.
    fn is_spaced(&self, token: Token) -> bool {
        let behind = &self.text[token.end as usize..];
        let is_blank = |c: char| c.is_ascii_whitespace();
        let before = &self.text[..token.start as usize];
        matches!(self.before, PrecedingToken::Sign | PrecedingToken::Tight { spaced: true })
            || before.ends_with(is_blank)
            || before.ends_with(['{', '}'])
            || behind.is_empty()
            || behind.starts_with(is_blank)
            || behind.starts_with('#')
            || behind.starts_with("///")
    }

    /// Whether a word that begins a line is a keyword or a new name, and not the first operand of the value of a
    /// function.
    fn begins_item(&self, token: Token) -> bool {
        let behind = self.text[token.end as usize..].trim_start_matches(' ');
        let is_operand = behind.starts_with(['(', '+', '*', '/', '^'])
            || behind.starts_with('-') && !behind.starts_with("->");
        !is_operand || is_keyword(token.text(self.text))
    }

    fn class(&self, token: Token) -> PrecedingToken {
        match token.kind {
            TokenKind::Name => {
                let is_word = RESERVED.contains(&token.text(self.text))
                    || match self.before {
                        PrecedingToken::Start => self.begins_item(token),
                        // Two words in a row, or a list of attributes.
                        PrecedingToken::Operand | PrecedingToken::Other(TokenKind::Comma) => {
                            self.open == 0
                        }
                        // `rises above`, `falls below`, `replace output y by`
                        PrecedingToken::Word => match token.text(self.text) {
                            "above" | "below" => true,
                            "output" => self.text[token.end as usize..].starts_with(' '),
                            _ => false,
                        },
                        PrecedingToken::Sign
                        | PrecedingToken::Tight { .. }
                        | PrecedingToken::Other(_) => false,
                    };
                if is_word { PrecedingToken::Word } else { PrecedingToken::Operand }
            }
            TokenKind::Number
            | TokenKind::Text
            | TokenKind::Unit
            | TokenKind::Index
            | TokenKind::Prime
            | TokenKind::Close => PrecedingToken::Operand,
            TokenKind::Minus if self.before != PrecedingToken::Operand => PrecedingToken::Sign,
            TokenKind::Star | TokenKind::Slash => {
                PrecedingToken::Tight { spaced: self.is_spaced(token) }
            }
            TokenKind::Range | TokenKind::Plus | TokenKind::Minus if self.in_range() => {
                PrecedingToken::Tight { spaced: self.is_spaced(token) }
            }
            kind => PrecedingToken::Other(kind),
        }
    }
}

#[cfg(test)]
mod tests;
