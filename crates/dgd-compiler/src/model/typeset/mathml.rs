//! Equations as presentation MathML, which browsers draw natively.
//!
//! Only elements of MathML Core are used.

use std::fmt::Write;

use super::formula::{
    Cases, Fence, Formula, FormulaLine, FormulaTransition, GREEK, MathOperator, MathSymbol,
    ReductionRange, TransitionOccasion,
};
use crate::syntax::ast::{BoundSide, ReductionOperation};

/// One line as a `<math>` element; its label is left to the caller.
pub fn write(line: &FormulaLine) -> String {
    // Fractions at full size, even if the element is inline.
    let mut text = "<math displaystyle=\"true\">".to_owned();
    // Writing to a string cannot fail.
    let _ = match line {
        FormulaLine::Equation { left, right, label: _ } => {
            write_equality(&mut text, left, "=", right)
        }
        FormulaLine::Mode(name) => write!(text, "<mtext>{}:</mtext>", escaped(name)),
        FormulaLine::Transition(transition) => write_transition(&mut text, transition),
        FormulaLine::Bound { left, side, right } => {
            let sign = match side {
                BoundSide::Lower => "≥",
                BoundSide::Upper => "≤",
            };
            write_equality(&mut text, left, sign, right)
        }
    };
    text.push_str("</math>");
    text
}

fn write_equality(
    text: &mut String,
    left: &Formula,
    sign: &str,
    right: &Formula,
) -> std::fmt::Result {
    write_formula(text, left)?;
    write!(text, "<mo>{sign}</mo>")?;
    write_formula(text, right)
}

fn write_transition(text: &mut String, transition: &FormulaTransition) -> std::fmt::Result {
    let FormulaTransition { modes, occasion, resets } = transition;
    match (modes, occasion) {
        (Some([from, to]), _) => {
            let (from, to) = (escaped(from), escaped(to));
            write!(text, "<mtext>{from}</mtext><mo>→</mo><mtext>{to} when </mtext>")?;
        }
        (None, TransitionOccasion::When(_)) => text.push_str("<mtext>when </mtext>"),
        (None, TransitionOccasion::Every(..)) => text.push_str("<mtext>every </mtext>"),
    }
    match occasion {
        TransitionOccasion::Every(period, offset) => {
            write_formula(text, period)?;
            if let Some(offset) = offset {
                text.push_str("<mtext> offset </mtext>");
                write_formula(text, offset)?;
            }
        }
        TransitionOccasion::When(conditions) => {
            for (k, (left, crossing, right)) in conditions.iter().enumerate() {
                text.push_str(if k == 0 { "" } else { "<mtext> or </mtext>" });
                write_formula(text, left)?;
                write!(text, "<mtext> {} </mtext>", crossing.words())?;
                write_formula(text, right)?;
            }
        }
    }
    for (unknown, value) in resets {
        text.push_str("<mo>,</mo>");
        write_equality(text, unknown, ":=", value)?;
    }
    Ok(())
}

fn write_formula(text: &mut String, formula: &Formula) -> std::fmt::Result {
    match formula {
        Formula::Symbol(symbol) => write_symbol(text, symbol, write_letters),
        Formula::Dot(symbol) => write_symbol(text, symbol, |text, letters| {
            // A full stop: fonts without mathematics draw the dot above as a faint mark far from its letter.
            text.push_str("<mover accent=\"true\">");
            write_letters(text, letters)?;
            write!(text, "<mo class=\"dot\">.</mo></mover>")
        }),
        Formula::Indexed(of, index) => {
            text.push_str("<msub>");
            write_formula(text, of)?;
            text.push_str("<mrow>");
            write_formula(text, index)?;
            write!(text, "</mrow></msub>")
        }
        Formula::Over(over) => write_over(text, over),
        Formula::Number { digits, exponent, unit } => {
            text.push_str("<mrow>");
            write!(text, "<mn>{digits}</mn>")?;
            if let Some(exponent) = exponent {
                let exponent = exponent.replace('-', "−");
                write!(text, "<mo>·</mo><msup><mn>10</mn><mn>{exponent}</mn></msup>")?;
            }
            if let Some(unit) = unit {
                write!(text, "<mspace width=\"0.17em\"/><mtext>{}</mtext>", escaped(unit))?;
            }
            text.push_str("</mrow>");
            Ok(())
        }
        Formula::Row(parts) => {
            text.push_str("<mrow>");
            parts.iter().try_for_each(|part| write_formula(text, part))?;
            text.push_str("</mrow>");
            Ok(())
        }
        Formula::Operator(operator) => {
            text.push_str(sign(*operator));
            Ok(())
        }
        Formula::Fraction(above, below) => write_element(text, "mfrac", &[above, below]),
        Formula::Power(base, exponent) => write_element(text, "msup", &[base, exponent]),
        Formula::Root(inner) => write_element(text, "msqrt", &[inner]),
        Formula::Fenced(fence, inner) => {
            let (opening, closing, stretchy) = match fence {
                Fence::Round => ("(", ")", "true"),
                Fence::Arguments => ("(", ")", "false"),
                Fence::Bars => ("|", "|", "true"),
                Fence::Floor => ("⌊", "⌋", "true"),
                Fence::Ceiling => ("⌈", "⌉", "true"),
            };
            text.push_str("<mrow>");
            write!(text, "<mo form=\"prefix\" fence=\"true\" stretchy=\"{stretchy}\">")?;
            write!(text, "{opening}</mo>")?;
            write_formula(text, inner)?;
            write!(text, "<mo form=\"postfix\" fence=\"true\" stretchy=\"{stretchy}\">")?;
            write!(text, "{closing}</mo></mrow>")
        }
        Formula::Function(name, None) => write!(text, "<mi mathvariant=\"normal\">{name}</mi>"),
        Formula::Function(name, Some(foot)) => {
            write!(text, "<msub><mi mathvariant=\"normal\">{name}</mi><mn>{foot}</mn></msub>")
        }
        Formula::Words(words) => write!(text, "<mtext> {words} </mtext>"),
        Formula::Cases(cases) => write_cases(text, cases),
    }
}

/// Σ with limits below and above, or a function with its indices as a subscript.
fn write_over(
    text: &mut String,
    ReductionRange { kind, counters, body }: &ReductionRange,
) -> std::fmt::Result {
    let sign = match kind {
        ReductionOperation::Sum => "<mo>∑</mo>",
        ReductionOperation::Product => "<mo>∏</mo>",
        ReductionOperation::Least => "<mi mathvariant=\"normal\">min</mi>",
        ReductionOperation::Greatest => "<mi mathvariant=\"normal\">max</mi>",
        ReductionOperation::Mean => "<mi mathvariant=\"normal\">mean</mi>",
    };
    let has_ends = matches!(kind, ReductionOperation::Sum | ReductionOperation::Product);
    text.push_str("<mrow>");
    for [index, first, last] in counters {
        let element = if has_ends { "munderover" } else { "munder" };
        write!(text, "<{element}>{sign}<mrow>")?;
        write_formula(text, index)?;
        text.push_str("<mo>=</mo>");
        write_formula(text, first)?;
        text.push_str(if has_ends { "</mrow>" } else { "<mo>,</mo><mo>…</mo><mo>,</mo>" });
        write_formula(text, last)?;
        text.push_str(if has_ends { "" } else { "</mrow>" });
        write!(text, "</{element}>")?;
    }
    write_formula(text, body)?;
    text.push_str("</mrow>");
    Ok(())
}

fn write_element(text: &mut String, element: &str, parts: &[&Formula]) -> std::fmt::Result {
    write!(text, "<{element}>")?;
    parts.iter().try_for_each(|part| write_formula(text, part))?;
    write!(text, "</{element}>")
}

fn write_cases(text: &mut String, cases: &Cases) -> std::fmt::Result {
    let Cases { then, condition, otherwise } = cases;
    write!(text, "<mrow><mo form=\"prefix\" fence=\"true\" stretchy=\"true\">{{</mo><mtable>")?;
    write!(text, "<mtr>")?;
    write_element(text, "mtd", &[then])?;
    write!(text, "<mtd><mtext>if </mtext>")?;
    write_formula(text, condition)?;
    write!(text, "</mtd></mtr><mtr>")?;
    write_element(text, "mtd", &[otherwise])?;
    write!(text, "<mtd><mtext>otherwise</mtext></mtd></mtr></mtable></mrow>")
}

fn sign(operator: MathOperator) -> &'static str {
    match operator {
        MathOperator::Plus => "<mo>+</mo>",
        MathOperator::Minus => "<mo>−</mo>",
        MathOperator::Negative => "<mo form=\"prefix\">−</mo>",
        // Invisible times, with the width of a thin space.
        MathOperator::Times => "<mo lspace=\"0\" rspace=\"0.17em\">\u{2062}</mo>",
        MathOperator::Comma => "<mo>,</mo>",
        MathOperator::Equal => "<mo>=</mo>",
        MathOperator::Less => "<mo>&lt;</mo>",
        MathOperator::LessEqual => "<mo>≤</mo>",
        MathOperator::Greater => "<mo>&gt;</mo>",
        MathOperator::GreaterEqual => "<mo>≥</mo>",
        MathOperator::And => "<mo>∧</mo>",
        MathOperator::Or => "<mo>∨</mo>",
        MathOperator::Not => "<mo form=\"prefix\">¬</mo>",
    }
}

/// The base, written by `base`, with the symbol's subscripts.
fn write_symbol(
    text: &mut String,
    MathSymbol { letters, subscripts }: &MathSymbol,
    base: fn(&mut String, &str) -> std::fmt::Result,
) -> std::fmt::Result {
    if subscripts.is_empty() {
        return base(text, letters);
    }
    text.push_str("<msub>");
    base(text, letters)?;
    text.push_str("<mrow>");
    for (i, part) in subscripts.iter().enumerate() {
        if i > 0 {
            text.push_str("<mo>,</mo>");
        }
        if !part.is_empty() && part.chars().all(|c| c.is_ascii_digit()) {
            write!(text, "<mn>{part}</mn>")?;
        } else {
            let part = greek(part).map_or_else(|| escaped(part), String::from);
            write!(text, "<mi>{part}</mi>")?;
        }
    }
    write!(text, "</mrow></msub>")
}

fn write_letters(text: &mut String, letters: &str) -> std::fmt::Result {
    if let Some(letter) = greek(letters) {
        write!(text, "<mi>{letter}</mi>")
    } else if letters.chars().count() > 1 {
        // MathML sets words upright.
        write!(text, "<mi class=\"slanted\">{}</mi>", escaped(letters))
    } else {
        write!(text, "<mi>{}</mi>", escaped(letters))
    }
}

fn greek(name: &str) -> Option<char> {
    GREEK.iter().find(|(spelling, _)| *spelling == name).map(|(_, letter)| *letter)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::Diagnostics;
    use crate::model::typeset::formula::lines;
    use crate::model::{ModelOptions, resolve};
    use crate::source::{SourceMap, SourceText};
    use crate::syntax::parse;

    fn typeset(text: &str) -> Vec<String> {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let id = sources.add(SourceText { name: "m".to_owned(), text: text.to_owned() });
        let ast = parse(id, &sources, &mut diagnostics).expect("it is syntax");
        let asts = [ast];
        let model = resolve(&asts, &ModelOptions::default(), &mut diagnostics).expect("a model");
        lines(&asts, &model).iter().map(write).collect()
    }

    #[test]
    fn a_derivative_has_its_dot_over_the_letter_and_quotients_a_bar() {
        let lines = typeset("model m\nstate h_r [1]\nequation e: der(h_r) = (2*h_r)/(3 [s])\n");
        assert_eq!(
            lines,
            [
                "<math displaystyle=\"true\"><msub><mover accent=\"true\"><mi>h</mi><mo class=\"dot\">.</mo></mover>\
              <mrow><mi>r</mi></mrow></msub><mo>=</mo><mfrac><mrow><mrow><mn>2</mn></mrow>\
              <mo lspace=\"0\" rspace=\"0.17em\">\u{2062}</mo>\
              <msub><mi>h</mi><mrow><mi>r</mi></mrow></msub></mrow>\
              <mrow><mn>3</mn><mspace width=\"0.17em\"/><mtext>s</mtext></mrow></mfrac></math>"
            ]
        );
    }

    const MODES: &str = "model m\nstate h [m]\nmodes tank {\n\
        up_1 { equation e: der(h) = 1 [m/s] }\ndown { equation e: der(h) = -1 [m/s] }\n\
        up_1 -> down when h rises above 2 [m] { reset h = 1 [m] }\n}\n";

    #[test]
    fn modes_and_transitions_are_lines() {
        let lines = typeset(MODES);
        assert_eq!(lines.len(), 5);
        assert_eq!(lines[0], "<math displaystyle=\"true\"><mtext>up_1:</mtext></math>");
        let crossing = "<mtext>up_1</mtext><mo>→</mo><mtext>down when </mtext><mi>h</mi>\
                        <mtext> rises above </mtext>";
        assert!(lines[4].contains(crossing), "{}", lines[4]);
        assert!(lines[4].contains("<mo>,</mo><mi>h</mi><mo>:=</mo>"), "{}", lines[4]);
    }

    #[test]
    fn every_element_is_closed_and_has_the_parts_it_needs() {
        let lines = typeset(
            "model m\nfunction f(x, rho) = if x < rho and not x >= 1 then sqrt(abs(x)) \
             else max(x, 1e-9)^log10(rho)\nlet level_in_2 = f(1, 2)\n\
             state x_r [1]\nequation e: der(x_r)*(1 [s])/2 = level_in_2\n",
        );
        assert_eq!(lines.len(), 3);
        for line in lines.into_iter().chain(typeset(MODES)) {
            // Names of open elements, each with its number of parts so far.
            let mut open: Vec<(&str, usize)> = Vec::new();
            for tag in line.split('<').skip(1) {
                let (tag, content) = tag.split_once('>').expect("tags end");
                assert!(!content.contains('>'), "{line}");
                if let Some(closed) = tag.strip_prefix('/') {
                    let (name, parts) = open.pop().unwrap_or_default();
                    assert_eq!(name, closed, "{line}");
                    let is_pair = matches!(name, "mfrac" | "msup" | "msub" | "mover");
                    assert!(!is_pair || parts == 2, "{name} of {parts}: {line}");
                    continue;
                }
                if let Some((_, parts)) = open.last_mut() {
                    *parts += 1;
                }
                if !tag.ends_with('/') {
                    open.push((tag.split(' ').next().unwrap_or_default(), 0));
                }
            }
            assert!(open.is_empty(), "{line}");
        }
    }
}
