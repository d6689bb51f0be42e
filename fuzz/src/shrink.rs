//! Shrinks a case to the smallest one that fails in the same way.

use std::time::{Duration, Instant};

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::{Ast, Expr, ExprKind, Item, ItemKind};
use dgd_compiler::syntax::parse;
use dgd_compiler::syntax::print::print;
use dgd_compiler::syntax::visit::{ItemPart, operands, operands_mut, parts_mut};

use crate::case::Case;
use crate::oracle::{Finding, judged};

/// A case that fails in the same way and cannot be reduced further, as far as time allows.
pub fn shrunk(case: &Case, finding: &Finding, most: Duration) -> Case {
    // Its facts hold for the complete case only.
    if finding.oracle == "facts" {
        return case.clone();
    }
    let until = Instant::now() + most;
    let oracle: Vec<String> = match finding.oracle {
        "accepted" => vec!["printed".to_owned()],
        "undefined" => vec!["runs".to_owned()],
        name => vec![name.to_owned()],
    };
    let fails = |case: &Case| {
        Instant::now() < until && judged(case, &oracle).iter().any(|found| found.is_like(finding))
    };
    let mut best = Case { facts: Vec::new(), ..case.clone() };
    loop {
        let before = best.clone();
        drop_rows(&mut best, &fails);
        drop_items(&mut best, &fails);
        simplify(&mut best, &fails);
        if best == before || Instant::now() >= until {
            return best;
        }
    }
}

fn read(text: &str) -> Option<Ast> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.to_owned() });
    parse(id, &sources, &mut Diagnostics::default()).ok()
}

fn with(case: &Case, ast: &Ast) -> Case {
    Case { model: print(ast), ..case.clone() }
}

/// Drops samples of the recording between the first and the last.
fn drop_rows(best: &mut Case, fails: &impl Fn(&Case) -> bool) {
    let mut row = 2;
    loop {
        let lines: Vec<&str> = best.data.lines().collect();
        if row + 1 >= lines.len() {
            return;
        }
        let mut lines = lines.clone();
        lines.remove(row);
        let candidate = Case { data: lines.join("\n") + "\n", ..best.clone() };
        if fails(&candidate) {
            *best = candidate;
        } else {
            row += 1;
        }
    }
}

/// Blocks of items inside an item.
fn inner(item: &mut Item) -> Vec<&mut Vec<Item>> {
    match &mut item.kind {
        ItemKind::For { items, .. } => vec![items],
        ItemKind::Variant { choices, .. } => choices.iter_mut().map(|c| &mut c.items).collect(),
        _ => Vec::new(),
    }
}

/// Drops items one by one, then in pairs: an unknown and its equation.
fn drop_items(best: &mut Case, fails: &impl Fn(&Case) -> bool) {
    let mut position = 0;
    while let Some(ast) = read(&best.model)
        && position < ast.items.len()
    {
        let mut less = ast.clone();
        less.items.remove(position);
        let mut candidate = with(best, &less);
        if fails(&candidate) {
            *best = candidate;
            continue;
        }
        let declares = matches!(
            ast.items[position].kind,
            ItemKind::Unknown { .. } | ItemKind::Array { .. } | ItemKind::Part { .. }
        );
        let mut dropped = false;
        if declares {
            for other in 0..less.items.len() {
                let mut less = less.clone();
                less.items.remove(other);
                candidate = with(best, &less);
                if fails(&candidate) {
                    *best = candidate;
                    dropped = true;
                    break;
                }
            }
        }
        if !dropped {
            let mut ast = ast;
            let blocks =
                inner(&mut ast.items[position]).iter().map(|b| b.len()).collect::<Vec<_>>();
            for (block, len) in blocks.into_iter().enumerate() {
                for k in (0..len).rev() {
                    let mut less = ast.clone();
                    inner(&mut less.items[position])[block].remove(k);
                    let candidate = with(best, &less);
                    if fails(&candidate) {
                        *best = candidate;
                        ast = less;
                    }
                }
            }
            position += 1;
        }
    }
}

fn number(text: &str) -> Expr {
    let value = text.parse().unwrap_or(1.0);
    let kind = ExprKind::Number { value, text: text.to_owned(), unit: None };
    Expr { span: Span::default(), kind }
}

/// Applies `act` to the expression with this number, in the order of the text.
fn nth(ast: &mut Ast, wanted: usize, act: &mut dyn FnMut(&mut Expr)) -> bool {
    fn walk(expr: &mut Expr, left: &mut usize, act: &mut dyn FnMut(&mut Expr)) -> bool {
        if *left == 0 {
            act(expr);
            return true;
        }
        *left -= 1;
        operands_mut(expr).into_iter().any(|operand| walk(operand, left, act))
    }
    let mut left = wanted;
    let mut done = false;
    for item in &mut ast.items {
        parts_mut(item, &mut |part| {
            if let ItemPart::Expr(_, expr) = part
                && !done
            {
                done = walk(expr, &mut left, act);
            }
        });
        if done {
            return true;
        }
    }
    false
}

/// Simpler replacements for an expression.
fn simpler(expr: &Expr) -> Vec<Expr> {
    let mut replacements: Vec<Expr> = operands(expr).into_iter().cloned().collect();
    match &expr.kind {
        ExprKind::Number { text, unit, .. } => {
            if unit.is_none() && text.len() > 3 {
                replacements.push(number(&format!("{:.1}", text.parse().unwrap_or(1.0f64))));
            }
            if unit.is_none() && text != "1" && text != "2" && text != "0" {
                replacements.push(number("1"));
            }
        }
        ExprKind::Compare(..) | ExprKind::And(_) | ExprKind::Or(_) | ExprKind::Not(_) => {}
        ExprKind::Sum(terms) => {
            if terms.len() > 2 {
                for k in 0..terms.len() {
                    let mut terms = terms.clone();
                    terms.remove(k);
                    replacements.push(Expr { span: expr.span, kind: ExprKind::Sum(terms) });
                }
            }
            replacements.push(number("1"));
        }
        ExprKind::Product(factors) => {
            if factors.len() > 2 {
                for k in 1..factors.len() {
                    let mut factors = factors.clone();
                    factors.remove(k);
                    replacements.push(Expr { span: expr.span, kind: ExprKind::Product(factors) });
                }
            }
            replacements.push(number("1"));
        }
        _ => replacements.push(number("1")),
    }
    // An expression that binds more weakly than its context is printed in parentheses.
    replacements
}

fn simplify(best: &mut Case, fails: &impl Fn(&Case) -> bool) {
    let mut number = 0;
    while let Some(mut ast) = read(&best.model) {
        let mut choices = Vec::new();
        if !nth(&mut ast, number, &mut |expr| choices = simpler(expr)) {
            return;
        }
        let mut changed = false;
        for choice in choices {
            let mut other = ast.clone();
            nth(&mut other, number, &mut |expr| *expr = choice.clone());
            for item in &mut other.items {
                parts_mut(item, &mut |part| {
                    if let ItemPart::Expr(_, expr) = part {
                        dgd_compiler::syntax::print::parenthesise(expr);
                    }
                });
            }
            let candidate = with(best, &other);
            if candidate.model.len() < best.model.len() && fails(&candidate) {
                *best = candidate;
                changed = true;
                break;
            }
        }
        if !changed {
            number += 1;
        }
    }
}
