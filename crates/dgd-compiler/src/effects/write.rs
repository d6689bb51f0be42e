//! Writes a changed model in the style of its author.
//!
//! Unchanged items keep their text, comments and lines. A changed expression is written in its place. The items of
//! effects follow the model's items, those of each effect under a remark that describes it.

use std::fmt::Write as _;
use std::ops::Range;

use super::AddedItems;
use crate::diagnostics::Diagnostics;
use crate::source::{SourceId, SourceMap, SourceText, Span};
use crate::syntax::ast::{Ast, Expr, ExprKind, Item, ItemKind};
use crate::syntax::places::without_places;
use crate::syntax::print::{print, print_expression, print_item};
use crate::syntax::visit::{self, ItemPart};
use crate::syntax::{layout, parse, parse_what_is_sound};

/// The text of `after`, which came from `before` by applying effects or setting values.
///
/// It is laid out canonically, and parsing it gives the tree `after`, apart from places.
pub fn write(before: &Ast, after: &Ast, brought: &[AddedItems], sources: &SourceMap) -> String {
    let text = sources.get(before.source).text.as_str();
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    let same = |a: &Item, b: &Item| a.span == b.span;
    // Removed items, with their replacements.
    let mut gone: Vec<Option<String>> = Vec::with_capacity(before.items.len());
    for item in &before.items {
        let successor = after.items.iter().find(|other| same(item, other));
        if let Some(other) = successor {
            item_edits(item, other, &mut edits);
        }
        gone.push(successor.is_none().then(|| as_remark(item, text, &mut edits)));
    }
    // Items of libraries replace the first import; items of a part replace the part.
    let mut behind = Appendix { sources, brought, text: String::new(), last: None };
    let mut next = 0;
    for item in &after.items {
        if let Some(at) = before.items.iter().position(|other| same(item, other)) {
            next = at + 1;
            continue;
        }
        if let Some(index) = brought.iter().position(|brought| is_of(item, brought)) {
            behind.item(item, index);
            continue;
        }
        let holder = (next..before.items.len()).find(|&at| holds(&before.items[at], item));
        let any = (next..gone.len()).find(|&at| gone[at].is_some());
        if let Some(place) = holder.or(any).and_then(|at| gone[at].as_mut().inspect(|_| next = at))
        {
            place.push_str(&print_item(item));
        }
    }
    let places = before.items.iter().map(|item| range(item.span));
    edits.extend(places.zip(gone).filter_map(|(place, new)| Some((place, new?))));
    edits.sort_by_key(|(range, _)| range.start);

    let mut out = String::with_capacity(text.len() + behind.text.len());
    let mut position = 0;
    for (range, edit) in edits {
        out.push_str(&text[position..range.start]);
        out.push_str(&edit);
        position = range.end;
    }
    out.push_str(&text[position..]);
    out.truncate(out.trim_end().len());
    out.push('\n');
    out.push_str(&behind.text);
    laid_out(&out, after).or_else(|| laid_out(&print(after), after)).unwrap_or_else(|| print(after))
}

/// The canonical layout of a text, if it parses to the tree.
fn laid_out(text: &str, ast: &Ast) -> Option<String> {
    let mut sources = SourceMap::default();
    let mut diagnostics = Diagnostics::default();
    let written = sources.add(SourceText { name: String::new(), text: text.to_owned() });
    let text = layout::format(written, &sources, &mut diagnostics).ok()?;
    let laid_out = sources.add(SourceText { name: String::new(), text: text.clone() });
    let read = parse(laid_out, &sources, &mut diagnostics).ok()?;
    (without_places(&read) == without_places(ast)).then_some(text)
}

fn range(span: Span) -> Range<usize> {
    span.start as usize..span.end as usize
}

/// A removed part as a remark, including its doc comment; empty for other items.
fn as_remark(item: &Item, text: &str, edits: &mut Vec<(Range<usize>, String)>) -> String {
    if !matches!(item.kind, ItemKind::Part { .. }) {
        return String::new();
    }
    let Range { start, end } = range(item.span);
    let line_start = |at: usize| text[..at].rfind('\n').map_or(0, |at| at + 1);
    let mut first = line_start(start);
    while first > 0 {
        let above = line_start(first - 1);
        let line = &text[above..first];
        let blanks = line.len() - line.trim_start().len();
        if !line[blanks..].starts_with("///") {
            break;
        }
        edits.push((above + blanks..above + blanks + 3, "#".to_owned()));
        first = above;
    }
    let behind = text[end..].lines().next().unwrap_or("");
    let blanks = behind.len() - behind.trim_start().len();
    if behind.trim_start().starts_with("///") {
        edits.push((end + blanks..end + blanks + 3, "#".to_owned()));
    }
    format!("# {}", print_item(&Item { doc: Vec::new(), ..item.clone() }))
}

/// Whether this is the part that held an item.
fn holds(part: &Item, item: &Item) -> bool {
    let ItemKind::Part { name, .. } = &part.kind else { return false };
    declared(item).is_some_and(|of| {
        of.strip_prefix(name.text.as_str()).is_some_and(|rest| rest.starts_with('.'))
    })
}

/// The first name that an item declares.
fn declared(item: &Item) -> Option<String> {
    let mut name = None;
    visit::parts_mut(&mut item.clone(), &mut |part| {
        if let ItemPart::Declares(_, declared) = part {
            name.get_or_insert_with(|| declared.text.clone());
        }
    });
    name
}

/// Whether an application has added an item.
fn is_of(item: &Item, brought: &AddedItems) -> bool {
    // An event or a bound declares nothing.
    declared(item).map_or(item.span.source == brought.source, |name| {
        brought.blend.as_ref() == Some(&name) || brought.names.iter().any(|(_, new)| *new == name)
    })
}

/// The edits that turn the text of one item into another.
fn item_edits(before: &Item, after: &Item, edits: &mut Vec<(Range<usize>, String)>) {
    if let (ItemKind::Variant { choices: before, .. }, ItemKind::Variant { choices: after, .. }) =
        (&before.kind, &after.kind)
    {
        for (before, after) in before.iter().zip(after) {
            for (before, after) in before.items.iter().zip(&after.items) {
                item_edits(before, after, edits);
            }
        }
        return;
    }
    if before == after {
        return;
    }
    let (old, new) = (expressions(before), expressions(after));
    if old.len() == new.len() && without_expressions(before) == without_expressions(after) {
        let changed = old.iter().zip(&new).filter(|(old, new)| old != new);
        edits.extend(changed.map(|(old, new)| (range(old.span), print_expression(new))));
        return;
    }
    let plain = Item { doc: Vec::new(), ..after.clone() };
    edits.push((range(before.span), print_item(&plain).trim_end().to_owned()));
}

fn expressions(item: &Item) -> Vec<Expr> {
    let mut expressions = Vec::new();
    visit::parts_mut(&mut item.clone(), &mut |part| {
        if let ItemPart::Expr(_, expr) = part {
            expressions.push(expr.clone());
        }
    });
    expressions
}

/// An item with all its expressions replaced by the same one.
fn without_expressions(item: &Item) -> Item {
    let mut item = item.clone();
    let nothing = ExprKind::Name(String::new());
    visit::parts_mut(&mut item, &mut |part| {
        if let ItemPart::Expr(_, expr) = part {
            *expr = Expr { span: Span::default(), kind: nothing.clone() };
        }
    });
    item
}

/// The text after the model's items.
struct Appendix<'a> {
    sources: &'a SourceMap,
    brought: &'a [AddedItems],
    text: String,
    /// The application and the item that were written last.
    last: Option<(usize, Span)>,
}

impl Appendix<'_> {
    fn item(&mut self, item: &Item, index: usize) {
        let brought = &self.brought[index];
        match self.last.filter(|(last, _)| *last == index) {
            None => {
                let _ = writeln!(self.text, "\n# {}", brought.name);
                for line in &brought.doc {
                    self.text.push_str(format!("# {line}").trim_end());
                    self.text.push('\n');
                }
            }
            Some((_, last)) => self.between(last, item.span),
        }
        self.last = Some((index, item.span));

        let source = self.sources.get(item.span.source);
        // Includes the blanks before it, so that aligned comments stay aligned.
        let line_end =
            source.text[item.span.end as usize..].lines().next().unwrap_or("").trim_end();
        let remark = line_end.trim_start();
        let trailing =
            if remark.starts_with('#') || remark.starts_with("///") { line_end } else { "" };
        // The doc comment at the end of the line is the last.
        let n_above = item.doc.len() - usize::from(remark.starts_with("///"));
        let above = item.doc[..n_above].to_vec();
        let as_read = read_again(item, self.sources);
        let body = match as_read {
            Some(text) => text.to_owned(),
            None => print_item(&Item { doc: Vec::new(), ..item.clone() }).trim_end().to_owned(),
        };
        for line in above {
            self.text.push_str(format!("/// {line}").trim_end());
            self.text.push('\n');
        }
        self.text.push_str(&body);
        self.text.push_str(trailing);
        self.text.push('\n');
    }

    /// Remarks and an empty line between two items of an effect's file.
    fn between(&mut self, last: Span, next: Span) {
        let text = &self.sources.get(next.source).text;
        let Some(between) = text.get(last.end as usize..next.start as usize) else { return };
        let lines: Vec<&str> = between.lines().skip(1).map(str::trim).collect();
        if lines.contains(&"") {
            self.text.push('\n');
        }
        for line in lines.iter().filter(|line| line.starts_with('#')) {
            self.text.push_str(line);
            self.text.push('\n');
        }
    }
}

/// The item's text in its file, if it still agrees with the item.
fn read_again<'a>(item: &Item, sources: &'a SourceMap) -> Option<&'a str> {
    let file: SourceId = item.span.source;
    let as_read = parse_what_is_sound(file, sources);
    as_read.items.iter().any(|other| other == item).then(|| sources.text(item.span))
}
