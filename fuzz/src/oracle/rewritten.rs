//! The same model, rewritten with other names, another order, other units.

use std::collections::BTreeMap;
use std::fmt::Write;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::{
    Ast, AttributeKind, Expr, ExprKind, FactorSide, Item, ItemKind, PriorLaw, Reaction,
    ResetClause, UnknownKind, WrittenUnit,
};
use dgd_compiler::syntax::print::print;
use dgd_compiler::syntax::visit::{ItemPart, items_mut, parts_mut};
use dgd_compiler::syntax::{parse, visit};

use super::runs::largest;
use super::{Finding, runs};
use crate::case::Case;
use crate::prepared::{EFFECT, Prepared};
use crate::truth::is_plain;

/// A unit, another one of its dimension, and the conversion factor.
const OTHER: &[(&str, &str, &str)] = &[
    ("cm", "mm", "10"),
    ("ft", "in", "12"),
    ("bar", "kPa", "100"),
    ("kPa", "bar", "0.01"),
    ("V", "mV", "1000"),
    ("kg", "g", "1000"),
    ("lpm", "l/s", "(1/60)"),
    ("1", "%", "100"),
    ("s", "min", "(1/60)"),
];

fn read(text: &str) -> Option<Ast> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.to_owned() });
    parse(id, &sources, &mut Diagnostics::default()).ok()
}

/// Names that items declare.
fn declared(ast: &mut Ast) -> Vec<String> {
    let mut names = Vec::new();
    for item in &mut ast.items {
        parts_mut(item, &mut |part| {
            if let ItemPart::Declares(_, name) = part {
                names.push(name.text.clone());
            }
        });
    }
    names
}

/// The text with names replaced as whole words.
pub(super) fn replaced(text: &str, names: &BTreeMap<String, String>) -> String {
    let mut out = String::new();
    let mut word = String::new();
    let mut quoted = false;
    for letter in text.chars().chain(['\n']) {
        if letter.is_alphanumeric() || letter == '_' {
            word.push(letter);
            continue;
        }
        // A part's own names, after a dot, stay.
        let known = if quoted || out.ends_with('.') && !out.ends_with("..") {
            None
        } else {
            names.get(&word)
        };
        out.push_str(known.unwrap_or(&word));
        word.clear();
        if letter == '"' {
            quoted = !quoted;
        }
        out.push(letter);
    }
    out.pop();
    out
}

/// Renames everything, with names in a different order.
fn renamed(case: &Case) -> Option<(Case, BTreeMap<String, String>)> {
    let mut ast = read(&case.model)?;
    let names: BTreeMap<String, String> = (declared(&mut ast).into_iter())
        // Words that may be units stay.
        .filter(|name| {
            name.len() > 1 && name.chars().any(|c| c.is_ascii_digit()) && !name.contains('.')
        })
        .map(|name| {
            let number: u64 =
                name.chars().filter(char::is_ascii_digit).collect::<String>().parse().unwrap_or(0);
            let new = format!("w{}_{name}", 999 - number % 999);
            (name, new)
        })
        .collect();
    let (header, rest) = case.data.split_once('\n').unwrap_or((&case.data, ""));
    let data = if case.data.is_empty() {
        String::new()
    } else {
        format!("{}\n{rest}", replaced(header, &names))
    };
    Some((Case { model: replaced(&case.model, &names), data, ..case.clone() }, names))
}

/// Items in reverse order; actions at one time keep their order.
fn reversed(case: &Case) -> Option<Case> {
    let mut ast = read(&case.model)?;
    let (acting, mut others): (Vec<Item>, Vec<Item>) =
        ast.items.into_iter().partition(|item| matches!(item.kind, ItemKind::When(_)));
    others.reverse();
    ast.items = others.into_iter().chain(acting).collect();
    Some(Case { model: print(&ast), ..case.clone() })
}

/// Converts a plain number to another unit.
fn scaled(expr: &mut Expr, factor: &str) {
    if !is_plain(expr) {
        return;
    }
    let (span, own) = (expr.span, expr.clone());
    let Some(ast) = read(&format!("constant c = 1*{factor}")) else { return };
    let Some(ItemKind::Constant { value, .. }) = ast.items.into_iter().next().map(|item| item.kind)
    else {
        return;
    };
    let group = Expr { span, kind: ExprKind::Group(Box::new(own)) };
    let ExprKind::Product(mut factors) = value.kind else { return };
    factors.insert(0, (FactorSide::Times, group));
    expr.kind = ExprKind::Product(factors);
}

fn change_unit(unit: &mut Option<WrittenUnit>) -> Option<&'static str> {
    let text = unit.as_ref().map_or("1", |unit| unit.text.as_str());
    let (_, other, factor) = OTHER.iter().find(|(symbol, ..)| *symbol == text)?;
    let span = unit.as_ref().map_or(Span::default(), |unit| unit.span);
    *unit = Some(WrittenUnit::new(span, *other));
    Some(factor)
}

fn rescale_resets(resets: &mut [ResetClause], unknowns: &BTreeMap<String, &str>) {
    for reset in resets {
        if let Some(factor) = unknowns.get(&reset.name.text) {
            scaled(&mut reset.value, factor);
        }
    }
}

/// Replaces every declared unit by another one.
fn rescaled(case: &Case) -> Option<Case> {
    let mut ast = read(&case.model)?;
    let mut unknowns: BTreeMap<String, &str> = BTreeMap::new();
    let mut columns: BTreeMap<String, f64> = BTreeMap::new();
    for item in &mut ast.items {
        let unknown = match &item.kind {
            ItemKind::Unknown { name, .. } => Some(name.text.clone()),
            _ => None,
        };
        let no_attributes = &mut Vec::new();
        let (unit, value, attributes) = match &mut item.kind {
            ItemKind::Constant { unit, value, .. } => (unit, Some(value), no_attributes),
            ItemKind::Parameter { unit, value, attributes, .. } => (unit, Some(value), attributes),
            ItemKind::Unknown { unit, start, attributes, .. } => (unit, start.as_mut(), attributes),
            ItemKind::Output { unit: unit @ Some(_), value, attributes, .. } => {
                (unit, value.as_mut(), attributes)
            }
            ItemKind::Input { name, unit, .. } => {
                if let Some(factor) = change_unit(unit) {
                    let factor =
                        if factor == "(1/60)" { 1.0 / 60.0 } else { factor.parse().ok()? };
                    columns.insert(name.text.clone(), factor);
                }
                continue;
            }
            _ => continue,
        };
        let Some(factor) = change_unit(unit) else { continue };
        if let Some(unknown) = unknown {
            unknowns.insert(unknown, factor);
        }
        if let Some(value) = value {
            scaled(value, factor);
        }
        for attribute in attributes {
            match &mut attribute.kind {
                AttributeKind::Bounds(lower, upper) => {
                    lower.iter_mut().chain(upper).for_each(|bound| scaled(bound, factor));
                }
                AttributeKind::Nominal(size)
                | AttributeKind::History(size)
                | AttributeKind::Smooth(size) => scaled(size, factor),
                AttributeKind::Noise(size) => match &mut size.kind {
                    // The deviation of a logarithm and degrees of freedom are plain numbers.
                    ExprKind::Call { function, .. } if function.text == "lognormal" => {}
                    ExprKind::Call { function, arguments } if function.text == "student" => {
                        arguments.iter_mut().skip(1).for_each(|size| scaled(size, factor));
                    }
                    _ => scaled(size, factor),
                },
                AttributeKind::Prior(law, a, b) => {
                    if *law != PriorLaw::Gamma {
                        scaled(a, factor);
                    }
                    if *law != PriorLaw::LogNormal {
                        scaled(b, factor);
                    }
                }
                AttributeKind::Log
                | AttributeKind::Fixed
                | AttributeKind::Guess
                | AttributeKind::Hold
                | AttributeKind::Linear
                | AttributeKind::Exact
                | AttributeKind::Shape(_)
                | AttributeKind::Beyond(_) => {}
            }
        }
    }
    // A plain number assigned to an unknown is in its unit.
    items_mut(&mut ast.items, &mut |item| match &mut item.kind {
        ItemKind::When(Reaction { resets, .. }) | ItemKind::Every { resets, .. } => {
            rescale_resets(resets, &unknowns);
        }
        ItemKind::Modes { transitions, .. } => {
            for transition in transitions {
                rescale_resets(&mut transition.resets, &unknowns);
            }
        }
        ItemKind::Saturate { name, bound, .. } => {
            if let Some(factor) = unknowns.get(&name.text) {
                scaled(bound, factor);
            }
        }
        _ => {}
    });
    let (header, rest) = case.data.split_once('\n').unwrap_or(("", ""));
    let names: Vec<&str> =
        header.split(',').map(|cell| cell.split_whitespace().next().unwrap_or("")).collect();
    let mut data = String::new();
    if !header.is_empty() {
        data = format!("{header}\n");
    }
    for line in rest.lines() {
        for (k, cell) in line.split(',').enumerate() {
            let comma = if k == 0 { "" } else { "," };
            match names.get(k).and_then(|name| columns.get(*name)) {
                Some(factor) => {
                    let value: f64 = cell.parse().ok()?;
                    let _ = write!(data, "{comma}{}", value * factor);
                }
                None => {
                    let _ = write!(data, "{comma}{cell}");
                }
            }
        }
        data.push('\n');
    }
    Some(Case { model: print(&ast), data, ..case.clone() })
}

pub(super) fn judge(case: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    // An effect refers to names that the rewriting changes.
    if case.files.contains_key(EFFECT) {
        return;
    }
    let Ok(solution) = prepared.run(&prepared.p, "rodas5p", 1e-8, false) else { return };
    let Ok(loose) = prepared.run(&prepared.p, "rodas5p", 1e-6, false) else { return };
    let events = |solution: &dgd_runtime::Solution, k: usize| {
        solution.events.iter().filter(|event| event.t <= solution.times[k]).count()
    };
    let rows = runs::Rows::new(prepared, &prepared.p, solution);
    let size = largest(prepared, &rows);
    let signature = prepared.signature();
    // Among tied states, the first declared ones are free.
    let mut follows = false;
    visit::items(&prepared.compiled.asts[0].items, &mut |item| {
        if let ItemKind::Unknown { declared: UnknownKind::State, name, .. } = &item.kind {
            follows |=
                signature.unknowns.iter().any(|x| x.name == name.text.as_str() && !x.differential);
        }
    });
    let same = BTreeMap::new();
    let renamed = renamed(case);
    let rewritten = [
        (
            "other names",
            renamed.as_ref().map(|(case, _)| case.clone()),
            renamed.as_ref().map_or(&same, |(_, names)| names),
        ),
        ("another order", if follows || case.is_ordered { None } else { reversed(case) }, &same),
        ("other units", rescaled(case), &same),
    ];
    for (what, other, names) in rewritten {
        let Some(other) = other else { continue };
        let prepared_other = match Prepared::new(&other) {
            Ok(prepared) => prepared,
            Err(finding) => {
                let detail = format!("{}\n{}", finding.detail, other.model);
                findings.push(Finding::new(
                    "rewritten",
                    format!("{what}: {}", finding.symptom),
                    detail,
                ));
                continue;
            }
        };
        let rewritten = match prepared_other.run(&prepared_other.p, "rodas5p", 1e-8, false) {
            Ok(found) => found,
            Err(failure) => {
                let detail = format!("{}\n{}", failure.error, other.model);
                findings.push(Finding::new("rewritten", format!("{what}: the run fails"), detail));
                continue;
            }
        };
        'rows: for k in 0..rows.solution.len() {
            let now = events(&rows.solution, k);
            if events(&rewritten, k) != now || events(&loose, k) != now {
                continue;
            }
            for (i, unknown) in signature.unknowns.iter().enumerate() {
                let own_name = unknown.name.to_string();
                // Shares of sliding modes are numbered in the order of their switches.
                if own_name.starts_with("share(") {
                    continue;
                }
                let name = names.get(&own_name).cloned().unwrap_or(own_name);
                let others = prepared_other.signature();
                let Some(at) = others.unknowns.iter().position(|x| x.name == name.as_str()) else {
                    continue;
                };
                let (a, b, c) = (rows.solution.y(k)[i], rewritten.y(k)[at], loose.y(k)[i]);
                let allowed = 1e-4 * size[i] + 300.0 * (a - c).abs();
                if !((a - b).abs() <= allowed) {
                    let detail = format!(
                        "{name} at {}: {a:e}, {b:e}\n{}",
                        rows.solution.times[k], other.model
                    );
                    findings.push(Finding::new(
                        "rewritten",
                        format!("{what}: another solution"),
                        detail,
                    ));
                    break 'rows;
                }
            }
        }
    }
}
