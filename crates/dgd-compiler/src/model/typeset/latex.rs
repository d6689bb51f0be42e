//! A model typeset as LaTeX, for `dgd emit --stage latex`.

use std::fmt::Write;

use super::formula::{
    self, Fence, Formula, FormulaLine, FormulaTransition, GREEK, MathOperator, MathSymbol,
    ReductionRange, TransitionOccasion,
};
use crate::model::Model;
use crate::syntax::ast::{Ast, BoundSide, ReductionOperation};

/// Writes the model's equations, ready for a document that uses `amsmath`.
pub fn write(asts: &[Ast], model: &Model) -> String {
    let lines: Vec<String> = formula::lines(asts, model).iter().map(line).collect();
    let mut text = format!("% {}\n", model.name);
    for doc in &model.doc {
        let _ = writeln!(text, "% {}", doc.trim());
    }
    let _ = writeln!(text, "\\begin{{align}}\n  {}\n\\end{{align}}", lines.join(" \\\\\n  "));
    text
}

/// The equations with a label, which each mode may have one of, as formulas for a text.
pub fn equations(asts: &[Ast], model: &Model, label: &str) -> Vec<String> {
    let lines = formula::lines(asts, model);
    let labelled = lines.iter().filter_map(|line| match line {
        FormulaLine::Equation { left, right, label: Some(own) } if own == label => {
            Some(format!("{} = {}", formula(left), formula(right)))
        }
        _ => None,
    });
    labelled.collect()
}

pub(super) fn line(line: &FormulaLine) -> String {
    match line {
        FormulaLine::Equation { left, right, label } => {
            let mut text = format!("{} &= {}", formula(left), formula(right));
            if let Some(label) = label {
                let _ = write!(text, " \\tag{{{}}}", escaped(label));
            }
            text
        }
        FormulaLine::Mode(name) => format!("&{}", upright(&format!("{name}:"))),
        FormulaLine::Transition(line) => transition(line),
        FormulaLine::Bound { left, side, right } => {
            let sign = match side {
                BoundSide::Lower => "\\ge",
                BoundSide::Upper => "\\le",
            };
            format!("{} &{sign} {}", formula(left), formula(right))
        }
    }
}

fn transition(FormulaTransition { modes, occasion, resets }: &FormulaTransition) -> String {
    let mut text = match (modes, occasion) {
        (Some([from, to]), _) => {
            format!("&{} \\to {} \\text{{ when }} ", upright(from), upright(to))
        }
        (None, TransitionOccasion::When(_)) => "&\\text{when } ".to_owned(),
        (None, TransitionOccasion::Every(..)) => "&\\text{every } ".to_owned(),
    };
    match occasion {
        TransitionOccasion::Every(period, offset) => {
            text.push_str(&formula(period));
            if let Some(offset) = offset {
                let _ = write!(text, " \\text{{ offset }} {}", formula(offset));
            }
        }
        TransitionOccasion::When(conditions) => {
            for (k, (left, crossing, right)) in conditions.iter().enumerate() {
                text.push_str(if k == 0 { "" } else { " \\text{ or } " });
                let crosses = crossing.words();
                let _ = write!(text, "{} \\text{{ {crosses} }} {}", formula(left), formula(right));
            }
        }
    }
    for (unknown, value) in resets {
        let _ = write!(text, ", {} := {}", formula(unknown), formula(value));
    }
    text
}

fn escaped(text: &str) -> String {
    text.replace('_', "\\_")
}

/// Text in a formula. Its underscores are outside of `\text`, in which not all LaTeX readers support them.
pub(super) fn upright(text: &str) -> String {
    format!("\\text{{{}}}", text.replace('_', "}\\_\\text{"))
}

pub(super) fn formula(formula: &Formula) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_formula(&mut text, formula);
    text
}

fn write_formula(text: &mut String, formula: &Formula) -> std::fmt::Result {
    match formula {
        Formula::Symbol(symbol) => write_symbol(text, symbol),
        Formula::Number { digits, exponent, unit } => {
            match exponent {
                Some(exponent) if digits == "1" => write!(text, "10^{{{exponent}}}")?,
                Some(exponent) => write!(text, "{digits} \\cdot 10^{{{exponent}}}")?,
                None => text.push_str(digits),
            }
            if let Some(unit) = unit {
                write!(text, "\\,\\mathrm{{{}}}", unit.replace('%', "\\%"))?;
            }
            Ok(())
        }
        Formula::Row(parts) => parts.iter().try_for_each(|part| write_formula(text, part)),
        Formula::Operator(operator) => {
            text.push_str(sign(*operator));
            Ok(())
        }
        Formula::Fraction(above, below) => {
            write_parts(text, &["\\frac{", "}{", "}"], &[above, below])
        }
        // The exponent of a name is above its subscript.
        Formula::Power(base, exponent) if matches!(**base, Formula::Symbol(_)) => {
            write_parts(text, &["", "^{", "}"], &[base, exponent])
        }
        Formula::Power(base, exponent) => write_parts(text, &["{", "}^{", "}"], &[base, exponent]),
        Formula::Root(inner) => write_parts(text, &["\\sqrt{", "}"], &[inner]),
        Formula::Fenced(fence, inner) => {
            let (opening, closing) = match fence {
                Fence::Round => ("\\left(", "\\right)"),
                Fence::Arguments => ("(", ")"),
                Fence::Bars => ("\\left\\lvert ", " \\right\\rvert"),
                Fence::Floor => ("\\left\\lfloor ", " \\right\\rfloor"),
                Fence::Ceiling => ("\\left\\lceil ", " \\right\\rceil"),
            };
            write_parts(text, &[opening, closing], &[inner])
        }
        Formula::Dot(symbol) => {
            text.push_str("\\dot{");
            write_letters(text, &symbol.letters)?;
            text.push('}');
            write_subscripts(text, &symbol.subscripts)
        }
        Formula::Indexed(of, index) => write_parts(text, &["{", "}_{", "}"], &[of, index]),
        Formula::Over(over) => write_over(text, over),
        Formula::Function(name, foot) => {
            if KNOWN.contains(name) {
                write!(text, "\\{name}")?;
            } else {
                write!(text, "\\operatorname{{{name}}}")?;
            }
            match foot {
                Some(foot) => write!(text, "_{{{foot}}}"),
                None => Ok(()),
            }
        }
        Formula::Words(words) => write!(text, " \\text{{ {words} }} "),
        Formula::Cases(cases) => {
            let around = [
                "\\begin{cases} ",
                " & \\text{if } ",
                " \\\\ ",
                " & \\text{otherwise} \\end{cases}",
            ];
            write_parts(text, &around, &[&cases.then, &cases.condition, &cases.otherwise])
        }
    }
}

/// Σ with limits below and above, or a function with its indices as a subscript.
fn write_over(
    text: &mut String,
    ReductionRange { kind, counters, body }: &ReductionRange,
) -> std::fmt::Result {
    let sign = match kind {
        ReductionOperation::Sum => "\\sum",
        ReductionOperation::Product => "\\prod",
        ReductionOperation::Least => "\\min",
        ReductionOperation::Greatest => "\\max",
        ReductionOperation::Mean => "\\operatorname{mean}",
    };
    let has_ends = matches!(kind, ReductionOperation::Sum | ReductionOperation::Product);
    for [index, first, last] in counters {
        if has_ends {
            write_parts(text, &[&format!("{sign}_{{"), " = ", "}^{", "} "], &[index, first, last])?;
        } else {
            let foot = [&format!("{sign}_{{")[..], " = ", ", \\dots, ", "} "];
            write_parts(text, &foot, &[index, first, last])?;
        }
    }
    write_formula(text, body)
}

/// Parts with the text before, between and after them.
fn write_parts(text: &mut String, around: &[&str], parts: &[&Formula]) -> std::fmt::Result {
    for (i, piece) in around.iter().enumerate() {
        text.push_str(piece);
        if let Some(part) = parts.get(i) {
            write_formula(text, part)?;
        }
    }
    Ok(())
}

/// Functions that have a command of their own.
const KNOWN: [&str; 11] =
    ["ln", "log", "sin", "cos", "tan", "exp", "sinh", "cosh", "tanh", "min", "max"];

fn sign(operator: MathOperator) -> &'static str {
    match operator {
        MathOperator::Plus => " + ",
        MathOperator::Minus => " - ",
        MathOperator::Negative => "-",
        MathOperator::Times => " \\, ",
        MathOperator::Comma => ", ",
        MathOperator::Equal => " = ",
        MathOperator::Less => " < ",
        MathOperator::LessEqual => " \\le ",
        MathOperator::Greater => " > ",
        MathOperator::GreaterEqual => " \\ge ",
        MathOperator::And => " \\land ",
        MathOperator::Or => " \\lor ",
        MathOperator::Not => "\\lnot ",
    }
}

fn write_symbol(text: &mut String, symbol: &MathSymbol) -> std::fmt::Result {
    write_letters(text, &symbol.letters)?;
    write_subscripts(text, &symbol.subscripts)
}

fn write_letters(text: &mut String, letters: &str) -> std::fmt::Result {
    if GREEK.iter().any(|(spelling, _)| *spelling == letters) {
        write!(text, "\\{letters}")?;
    } else if letters.chars().count() > 1 {
        write!(text, "\\mathit{{{letters}}}")?;
    } else {
        text.push_str(letters);
    }
    Ok(())
}

fn write_subscripts(text: &mut String, subscripts: &[String]) -> std::fmt::Result {
    for (i, part) in subscripts.iter().enumerate() {
        text.push_str(if i == 0 { "_{" } else { "," });
        if part.chars().count() == 1 || part.chars().all(|c| c.is_ascii_digit()) {
            text.push_str(part);
        } else {
            write!(text, "\\mathrm{{{part}}}")?;
        }
    }
    if !subscripts.is_empty() {
        text.push('}');
    }
    Ok(())
}
