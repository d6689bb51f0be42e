//! A model typeset: definitions, equations and outputs as LaTeX, for `dgd emit --stage latex`.
//!
//! The equations are those of the file, in the author's order and with the author's grouping; the
//! chosen variants' equations stand where the variant does.

use std::fmt::Write;

use super::Model;
use crate::expr::display::number;
use crate::syntax::ast::{
    Argument, Ast, Comparison, Crossing, Expr, ExprKind, Factor, Item, ItemKind, Sign, Transition,
};

/// Writes the model's equations, ready for a document that uses `amsmath`.
pub fn write(asts: &[Ast], model: &Model) -> String {
    let mut lines = Vec::new();
    for ast in asts.iter().rev() {
        collect(&ast.items, model, &mut lines);
    }
    let mut text = format!("% {}\n", model.name);
    for doc in &model.doc {
        let _ = writeln!(text, "% {}", doc.trim());
    }
    let _ = writeln!(text, "\\begin{{align}}\n  {}\n\\end{{align}}", lines.join(" \\\\\n  "));
    text
}

fn collect(items: &[Item], model: &Model, lines: &mut Vec<String>) {
    for item in items {
        match &item.kind {
            ItemKind::Let { name, value, .. }
            | ItemKind::Output { name, value: Some(value), .. } => {
                lines.push(format!("{} &= {}", symbol(&name.text), expression(value)));
            }
            ItemKind::Function { name, arguments, body } => {
                let arguments: Vec<String> =
                    arguments.iter().map(|Argument { name, .. }| symbol(&name.text)).collect();
                let (name, arguments) = (symbol(&name.text), arguments.join(", "));
                lines.push(format!("{name}({arguments}) &= {}", expression(body)));
            }
            ItemKind::Equation { label, left, right } => {
                let (left, right) = (expression(left), expression(right));
                lines.push(format!("{left} &= {right} \\tag{{{}}}", escaped(&label.text)));
            }
            ItemKind::Variant { name, choices } => {
                let chosen = model.variants.iter().find(|v| v.name == name.text);
                if let Some(choice) = chosen.and_then(|v| choices.get(v.chosen)) {
                    collect(&choice.items, model, lines);
                }
            }
            ItemKind::Modes { modes, transitions, .. } => {
                for mode in modes {
                    lines.push(format!("&\\text{{{}:}}", escaped(&mode.name.text)));
                    collect(&mode.items, model, lines);
                }
                lines.extend(transitions.iter().map(transition));
            }
            ItemKind::Import { .. }
            | ItemKind::Constant { .. }
            | ItemKind::Parameter { .. }
            | ItemKind::Input { .. }
            | ItemKind::Unknown { .. }
            | ItemKind::Output { .. } => {}
        }
    }
}

fn transition(transition: &Transition) -> String {
    let Transition { from, to, left, crossing, right, resets, .. } = transition;
    let (from, to) = (escaped(&from.text), escaped(&to.text));
    let crosses = match crossing {
        Crossing::Rises => "rises above",
        Crossing::Falls => "falls below",
    };
    let (left, right) = (expression(left), expression(right));
    let resets: Vec<String> = resets
        .iter()
        .map(|reset| format!(", {} := {}", symbol(&reset.name.text), expression(&reset.value)))
        .collect();
    format!(
        "&\\text{{{from}}} \\to \\text{{{to}}} \\text{{ when }} {left} \\text{{ {crosses} }} {right}{}",
        resets.concat()
    )
}

const GREEK: &[&str] = &[
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda", "mu",
    "nu", "xi", "pi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega", "Gamma", "Delta",
    "Theta", "Lambda", "Xi", "Pi", "Sigma", "Phi", "Psi", "Omega",
];

/// A name as papers set it: `h_r` is h with subscript r, `rho` is ρ, `c0` is c with subscript 0.
fn symbol(name: &str) -> String {
    let mut parts = name.split('_');
    let first = parts.next().unwrap_or_default();
    let letters = first.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &first[letters.len()..];
    let subscript: Vec<&str> =
        (!digits.is_empty()).then_some(digits).into_iter().chain(parts).collect();
    let base = if GREEK.contains(&letters) {
        format!("\\{letters}")
    } else if letters.chars().count() > 1 {
        format!("\\mathit{{{letters}}}")
    } else {
        letters.to_owned()
    };
    if subscript.is_empty() {
        return base;
    }
    let subscript: Vec<String> = subscript
        .iter()
        .map(|part| {
            if part.chars().count() == 1 || part.chars().all(|c| c.is_ascii_digit()) {
                (*part).to_owned()
            } else {
                format!("\\mathrm{{{part}}}")
            }
        })
        .collect();
    format!("{base}_{{{}}}", subscript.join(","))
}

fn escaped(text: &str) -> String {
    text.replace('_', "\\_")
}

/// What must be put in brackets where something tighter is wanted.
fn is_sum(expr: &Expr) -> bool {
    matches!(expr.kind, ExprKind::Sum(_) | ExprKind::Negate(_) | ExprKind::If(..))
}

fn expression(expr: &Expr) -> String {
    match &expr.kind {
        ExprKind::Number { value, unit, .. } => {
            let digits = number(*value);
            let digits = match digits.split_once('e') {
                Some((mantissa, exponent)) => format!("{mantissa} \\cdot 10^{{{exponent}}}"),
                None => digits,
            };
            match unit {
                Some(unit) => format!("{digits}\\,\\mathrm{{{}}}", unit.text.replace('%', "\\%")),
                None => digits,
            }
        }
        ExprKind::Name(name) if name == "time" => "t".to_owned(),
        ExprKind::Name(name) => symbol(name),
        ExprKind::Call { function, arguments } => call(&function.text, arguments),
        ExprKind::Group(inner) => format!("\\left({}\\right)", expression(inner)),
        ExprKind::Negate(inner) if is_sum(inner) => {
            format!("-\\left({}\\right)", expression(inner))
        }
        ExprKind::Negate(inner) => format!("-{}", expression(inner)),
        ExprKind::Sum(terms) => {
            let mut text = String::new();
            for (i, (sign, term)) in terms.iter().enumerate() {
                text.push_str(match (i, sign) {
                    (0, Sign::Plus) => "",
                    (0, Sign::Minus) => "-",
                    (_, Sign::Plus) => " + ",
                    (_, Sign::Minus) => " - ",
                });
                text.push_str(&expression(term));
            }
            text
        }
        ExprKind::Product(factors) => product(factors),
        ExprKind::Power(base, exponent) => {
            format!("{{{}}}^{{{}}}", expression(base), expression(bare(exponent)))
        }
        ExprKind::If(condition, then, otherwise) => format!(
            "\\begin{{cases}} {} & \\text{{if }} {} \\\\ {} & \\text{{otherwise}} \\end{{cases}}",
            expression(then),
            expression(condition),
            expression(otherwise)
        ),
        ExprKind::Compare(comparison, left, right) => {
            let sign = match comparison {
                Comparison::Less => "<",
                Comparison::LessEqual => "\\le",
                Comparison::Greater => ">",
                Comparison::GreaterEqual => "\\ge",
            };
            format!("{} {sign} {}", expression(left), expression(right))
        }
        ExprKind::And(parts) => joined(parts, " \\land "),
        ExprKind::Or(parts) => joined(parts, " \\lor "),
        ExprKind::Not(inner) => format!("\\lnot {}", expression(inner)),
    }
}

/// Factors up to the first division stand above the bar with those multiplied later.
fn product(factors: &[(Factor, Expr)]) -> String {
    let side = |wanted: Factor| {
        let parts: Vec<&Expr> =
            factors.iter().filter(|(factor, _)| *factor == wanted).map(|(_, e)| e).collect();
        match parts[..] {
            // A lone factor needs no brackets next to a bar.
            [only] if factors.iter().any(|(f, _)| *f == Factor::Over) => expression(bare(only)),
            _ => parts.into_iter().map(expression).collect::<Vec<_>>().join(" \\, "),
        }
    };
    if factors.iter().all(|(factor, _)| *factor == Factor::Times) {
        return side(Factor::Times);
    }
    format!("\\frac{{{}}}{{{}}}", side(Factor::Times), side(Factor::Over))
}

/// Without brackets around the whole.
fn bare(expr: &Expr) -> &Expr {
    match &expr.kind {
        ExprKind::Group(inner) => bare(inner),
        _ => expr,
    }
}

fn joined(parts: &[Expr], operator: &str) -> String {
    parts.iter().map(expression).collect::<Vec<_>>().join(operator)
}

fn call(function: &str, arguments: &[Expr]) -> String {
    let list = joined(arguments, ", ");
    match (function, arguments) {
        ("der", [Expr { kind: ExprKind::Name(name), .. }]) => format!("\\dot{{{}}}", symbol(name)),
        ("sqrt", _) => format!("\\sqrt{{{list}}}"),
        ("abs", _) => format!("\\left|{list}\\right|"),
        ("log", _) => format!("\\ln\\left({list}\\right)"),
        ("log10", _) => format!("\\log_{{10}}\\left({list}\\right)"),
        ("sin" | "cos" | "tan" | "exp" | "sinh" | "cosh" | "tanh" | "min" | "max", _) => {
            format!("\\{function}\\left({list}\\right)")
        }
        ("asin" | "acos" | "atan" | "atan2" | "sign", _) => {
            format!("\\operatorname{{{function}}}\\left({list}\\right)")
        }
        _ => format!("{}\\left({list}\\right)", symbol(function)),
    }
}
