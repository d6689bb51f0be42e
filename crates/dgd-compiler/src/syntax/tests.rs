//! Whole files: their trees, their errors, and their text printed again.

use std::fmt::Write as _;

use super::ast::*;
use super::parse;
use super::parse::tokens::NESTING;
use super::places::without_places;
use super::print::{print, print_expression};
use crate::diagnostics::codes::CODES;
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::source::{SourceMap, SourceText, Span};

/// A whole model.
pub(super) const CIRCULATION: &str = include_str!("../../../../models/mud_circulation.dgd");

fn read(text: &str) -> Result<Ast, Vec<Diagnostic>> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "test.dgd".into(), text: text.into() });
    let mut diagnostics = Diagnostics::default();
    parse(id, &sources, &mut diagnostics)
        .map_err(|_| diagnostics.sorted().into_iter().cloned().collect())
}

fn codes(text: &str) -> Vec<String> {
    match read(text) {
        Ok(_) => Vec::new(),
        Err(mistakes) => mistakes.iter().map(|mistake| mistake.code.to_string()).collect(),
    }
}

/// Texts with pieces of themselves, or of the language, inserted at random places.
pub(super) fn mutated(text: &str, count: usize) -> impl Iterator<Item = String> {
    const PIECES: &[&str] = &[
        "(",
        ")",
        "{",
        "}",
        "[",
        "]",
        "\"",
        "#",
        "///",
        "..",
        ".",
        ",",
        ":",
        "=",
        "->",
        "\n",
        "\r\n",
        "-",
        "*",
        "/",
        "^",
        "not ",
        " and ",
        "if ",
        " then ",
        " else ",
        "in ",
        "log",
        "1e999",
        "3",
        "°",
        "²",
        "\u{0}",
        "state ",
        "model ",
        "variant x {",
        "<",
        ">=",
        "der(",
        "é",
        "\u{feff}",
    ];
    // A linear congruential generator (Knuth's MMIX constants) is random enough, and reproducible.
    let mut state = 1_u64;
    let mut below = move |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % n.max(1)
    };
    let base: Vec<char> = text.chars().collect();
    (0..count).map(move |_| {
        let mut letters = base.clone();
        for _ in 0..=below(3) {
            let at = below(letters.len());
            let end = (at + below(12)).min(letters.len());
            let replacement: Vec<char> = match below(4) {
                0 => Vec::new(),
                1 => PIECES[below(PIECES.len())].chars().collect(),
                2 => {
                    let from = below(base.len());
                    base[from..(from + below(20)).min(base.len())].to_vec()
                }
                _ => letters[at..end].iter().chain(&letters[at..end]).copied().collect(),
            };
            letters.splice(at..end, replacement);
        }
        letters.into_iter().collect()
    })
}

/// The right side of `let x = …`, fully parenthesised.
fn shape(text: &str) -> String {
    let ast = read(&format!("let x = {text}\n")).unwrap_or_else(|e| panic!("{text}: {e:?}"));
    match &ast.items[0].kind {
        ItemKind::Let { value, .. } => grouped(value),
        other => panic!("{other:?}"),
    }
}

fn grouped(expr: &Expr) -> String {
    match &expr.kind {
        ExprKind::Number { text, .. } => text.clone(),
        ExprKind::Name(name) => name.clone(),
        ExprKind::Call { function, arguments } => {
            let arguments: Vec<String> = arguments.iter().map(grouped).collect();
            format!("{}({})", function.text, arguments.join(","))
        }
        ExprKind::Group(inner) => grouped(inner),
        ExprKind::Element(array, index) => format!("{}[{}]", grouped(array), grouped(index)),
        ExprKind::Negate(operand) => format!("(-{})", grouped(operand)),
        ExprKind::Sum(terms) => {
            terms.iter().fold(String::from("("), |mut out, (sign, term)| {
                let _ =
                    write!(out, "{}{}", if *sign == Sign::Plus { '+' } else { '-' }, grouped(term));
                out
            }) + ")"
        }
        ExprKind::Product(factors) => {
            factors.iter().fold(String::from("("), |mut out, (sign, factor)| {
                let sign = if *sign == FactorSide::Times { '*' } else { '/' };
                let _ = write!(out, "{sign}{}", grouped(factor));
                out
            }) + ")"
        }
        ExprKind::Power(base, exponent) => format!("({}^{})", grouped(base), grouped(exponent)),
        ExprKind::If(c, a, b) => format!("(if {} {} {})", grouped(c), grouped(a), grouped(b)),
        ExprKind::Compare(sign, a, b) => format!("({sign:?} {} {})", grouped(a), grouped(b)),
        ExprKind::And(all) => format!("(and {})", all.iter().map(grouped).collect::<String>()),
        ExprKind::Or(all) => format!("(or {})", all.iter().map(grouped).collect::<String>()),
        ExprKind::Not(operand) => format!("(not {})", grouped(operand)),
        ExprKind::List(all) => {
            format!("({})", all.iter().map(grouped).collect::<Vec<_>>().join(","))
        }
        ExprKind::Reduce(reduction) => {
            let mut text = format!("{}({}", reduction.kind.word(), grouped(&reduction.body));
            for LoopCounter { index, range } in &reduction.counters {
                let (lower, upper) = (grouped(&range.lower), grouped(&range.upper));
                let _ = write!(text, ";{}={lower}..{upper}", index.text);
            }
            text + ")"
        }
    }
}

#[test]
fn operators_bind_as_in_mathematics() {
    for (text, expected) in [
        ("-x^2", "(-(x^2))"),
        ("2^-3^2", "(2^(-(3^2)))"),
        ("a^b^c", "(a^(b^c))"),
        ("a - b + c", "(+a-b+c)"),
        ("T[i - 1][2*j]", "T[(+i-1)][(*2*j)]"),
        ("2*sum(a + x[i]*k for i in 1..N - 1)^2", "(*2*(sum((+a+(*x[i]*k));i=1..(+N-1))^2))"),
        (
            "min(if a < b then c else d for j in 1..2, k in 0..j)",
            "min((if (Less a b) c d);j=1..2;k=0..j)",
        ),
        ("min(a, sum)", "min(a,sum)"),
        ("-p[i - 1]^2", "(-(p[(+i-1)]^2))"),
        ("a/b*c", "(*a/b*c)"),
        ("-a*b", "(*(-a)*b)"),
        ("a*-b", "(*a*(-b))"),
        ("a + b*c^2", "(+a+(*b*(c^2)))"),
        ("(a + b)*c", "(*(+a+b)*c)"),
        ("if a < b then c else d + 1", "(if (Less a b) c (+d+1))"),
        ("2*if a < b then c else d + 1", "(*2*(if (Less a b) c (+d+1)))"),
        (
            "if a < 1 and not b > 2 or c >= 3 then 1 else if d <= 4 then 2 else 3",
            "(if (or (and (Less a 1)(not (Greater b 2)))(GreaterEqual c 3)) 1 (if (LessEqual d 4) 2 3))",
        ),
        ("max(a, -b)", "max(a,(-b))"),
        ("3 [m/s] * t", "(*3*t)"),
        ("log + input*state", "(+log+(*input*state))"),
    ] {
        assert_eq!(shape(text), expected, "{text}");
    }
}

#[test]
fn the_example_is_read_whole() {
    let ast = read(CIRCULATION).unwrap();
    assert_eq!(ast.model.as_ref().unwrap().name.text, "mud_circulation");
    let before = CIRCULATION.lines().take_while(|line| !line.starts_with("model"));
    assert_eq!(ast.model.as_ref().unwrap().doc.len(), before.count());
    // Each item of this file starts on a line of its own.
    let begins = |line: &&str| line.starts_with(|c: char| c.is_alphabetic());
    assert_eq!(ast.items.len() + 1, CIRCULATION.lines().filter(begins).count());
    assert_eq!(ast.items[3].doc, ["subsea pump inlet, below the rig floor"]);
    let span = ast.items[0].span;
    let text = &CIRCULATION[span.start as usize..span.end as usize];
    assert_eq!(text, "constant g     [m/s^2]  = 9.81");
}

#[test]
fn printing_and_parsing_give_the_same_tree() {
    let more = "\
/// Library.\nimport \"a b.dgd\"\n\
/// One.\n///\n///   Two.\nfunction f(a, b [m]) = if a > 1 then b else -b^2  /// Three.\n\
variant v {  /// V\n  /// A, first.\n  a { let x = 1\n let y = (2) } /// A\n  b {}\n}\n\
parameter p [1] = 1 in .. 2, log, fixed, nominal 3 [%], prior normal(1, 0.5)\n\
parameter r = 1 in ..\n\
unknown f = 0.02 nominal 1\n\
table t(x [m]) at (0, 1, 2) = q  linear, beyond hold, smooth 0.05*(a + 1)\n\
let c = not a < 1 and (b > 2 or 1 < 2) or d <= 3\n\
let e = (if a < 1 then 2 else 3)*4 - 2^-x^2 + -f(1, 2.50)/3e-7\n";
    for text in [CIRCULATION, more] {
        let first = without_places(&read(text).unwrap());
        let printed = print(&first);
        let second = without_places(&read(&printed).unwrap_or_else(|e| panic!("{printed}: {e:?}")));
        assert_eq!(first, second, "{printed}");
        assert_eq!(print(&second), printed);
    }
}

#[test]
fn a_tree_put_together_gets_the_parentheses_it_needs() {
    let expr = |kind| Expr { span: Span::default(), kind };
    let name = |text: &str| expr(ExprKind::Name(text.into()));
    let sum = || expr(ExprKind::Sum(vec![(Sign::Plus, name("a")), (Sign::Minus, name("b"))]));
    let choice = || expr(ExprKind::If(Box::new(name("c")), Box::new(sum()), Box::new(sum())));
    let product = |first, second| {
        expr(ExprKind::Product(vec![(FactorSide::Times, first), (FactorSide::Over, second)]))
    };
    for (tree, expected) in [
        (product(sum(), sum()), "(a - b)/(a - b)"),
        (product(choice(), choice()), "(if c then a - b else a - b)/if c then a - b else a - b"),
        (expr(ExprKind::Negate(Box::new(sum()))), "-(a - b)"),
        (expr(ExprKind::Power(Box::new(sum()), Box::new(sum()))), "(a - b)^(a - b)"),
        (expr(ExprKind::Sum(vec![(Sign::Plus, name("a")), (Sign::Minus, sum())])), "a - (a - b)"),
    ] {
        assert_eq!(print_expression(&tree), expected);
    }
}

#[test]
fn independent_mistakes_are_all_reported_and_none_twice() {
    let text = "\
model tank
constant g [m/s^2] =
let a = (1 + 2
state h [m] = 3 log
equation level der(h) = 0
let ok = 1
let b = 2 $ 3
paramter c = 1
modes string {
  a { let x = = }
  b -> c when x
}
part pump: subsea_pump
let d = 0 < a < 1
output p [bar] = width [m]
";
    assert_eq!(
        codes(text),
        ["E105", "E115", "E107", "E105", "E101", "E116", "E105", "E105", "E109", "E117"]
    );
}

#[test]
fn mistakes_have_their_codes() {
    for (text, code) in [
        ("let a = 1 2", "E105"),
        ("let a = b c", "E105"),
        ("let a = 2)", "E115"),
        ("}", "E115"),
        ("variant v { a { let x = 1 }", "E115"),
        ("variant v { a { let x = 1 } } let b = 2", "E105"),
        ("variant v { }", "E105"),
        ("variant v { a { let x = 1", "E115"),
        ("model a\nmodel b", "E114"),
        ("/// nothing", "E118"),
        ("let if = 1", "E119"),
        ("function delay(x) = x", "E119"),
        ("pump.q + 1", "E105"),
        ("let a = pump.", "E101"),
        ("part pump", "E105"),
        ("part pump: subsea_pump(c0)", "E115"),
        ("part pump: subsea_pump(c0 = 1", "E115"),
        ("state p[1..N [bar] = 1", "E104"),
        ("state p[1..] = 1", "E105"),
        ("state p[m] = 1", "E105"),
        ("constant h[m] = 1", "E105"),
        ("let a = p[1 2]", "E105"),
        ("let a = p[]", "E105"),
        ("let a = p[1] [2]", "E117"),
        ("for i in 1..2 { equation a: b = 1 }", "E131"),
        ("for i in 1..2 { for j in 1..2 { equation a[j]: b = 1 } }", "E131"),
        ("for i { equation a[i]: b = 1 }", "E105"),
        ("for i in 1 { equation a[i]: b = 1 }", "E105"),
        ("size N", "E111"),
        ("size N = 1 fixed", "E107"),
        ("parameter a = 1 in 0 .. 1 log", "E105"),
        ("parameter a = 1 lgo", "E107"),
        ("constant a = 1 fixed", "E107"),
        ("input a = 1", "E105"),
        ("input a hold, linear", "E108"),
        ("equation a: b = c = d", "E105"),
        ("equation a: b", "E105"),
        ("let a = if b == c then 1 else 2", "E109"),
        ("let a = if b < c then 1", "E105"),
        ("let a = b**2", "E105"),
        ("let a = // b", "E105"),
        ("", "E112"),
        ("import friction", "E105"),
        ("parameter a", "E111"),
        ("let a = 1\nreplace output y by gain*y", "E120"),
        ("effect e on m\nvariant v { a { kind sensor } }", "E120"),
        ("let a = 1\neffect e on m", "E114"),
        ("effect e", "E105"),
        ("effect e(y: outputs)", "E105"),
        ("effect e on m\nkind sensr", "E105"),
        ("effect e on m\nreplace y in z 2", "E105"),
    ] {
        assert_eq!(codes(text), [code], "{text}");
    }
}

#[test]
fn every_syntax_code_has_an_example_that_is_wrong_and_one_that_is_right() {
    // A nesting of 128 does not fit a page, and whether a model line is required depends on the use.
    let not_here = [Code::NestedTooDeep, Code::NoModelLine];
    for info in CODES.iter().filter(|i| i.code < Code::UnknownName && !not_here.contains(&i.code)) {
        let (_, examples) = info.explanation.split_once("\nWrong:\n\n").unwrap();
        let (wrong, right) = examples.split_once("\nRight:\n\n").unwrap();
        let plain = |text: &str| -> String {
            text.lines().map(|line| line.get(4..).unwrap_or("").to_owned() + "\n").collect()
        };
        let wrong = codes(&plain(wrong));
        assert!(!wrong.is_empty(), "{}", info.code);
        assert!(
            wrong.iter().all(|code| *code == info.code.to_string()),
            "{}: {wrong:?}",
            info.code
        );
        let right = plain(right);
        assert_eq!(codes(&right), Vec::<String>::new(), "{}: {right}", info.code);
    }
}

#[test]
fn nesting_is_limited_and_costs_little_stack() {
    let nested = |open: &str, close: &str, n: usize| {
        format!("let x = {}1{}\n", open.repeat(n), close.repeat(n))
    };
    let limit = NESTING as usize;
    assert_eq!(codes(&nested("(", ")", limit)), Vec::<String>::new());
    assert_eq!(codes(&nested("(", ")", limit + 1)), ["E106"]);
    for (open, close) in [
        ("(", ")"),
        ("-", ""),
        ("not ", ""),
        ("2^", ""),
        ("f(", ")"),
        ("if a < b then 1 else ", ""),
        ("if ", " < 1 then 2 else 3"),
        ("if a < b then ", " else 3"),
        ("(2^-", ")"),
    ] {
        assert_eq!(codes(&nested(open, close, 20_000)), ["E106"], "{open}");
        assert_eq!(codes(&nested(open, "", 20_000)), ["E106"], "{open}");
    }
    let blocks = format!("{}{}", "variant v {\na {\n".repeat(300), "}\n}\n".repeat(300));
    assert_eq!(codes(&blocks), ["E106"]);
}

#[test]
fn long_sums_are_no_nesting_and_many_items_take_no_time() {
    let sum = format!("let x = {}1\n", "a*b - ".repeat(100_000));
    assert!(read(&sum).is_ok());
    let mut many = String::new();
    for i in 0..10_000 {
        let _ = writeln!(many, "equation e{i}: der(x{i}) = -a*(x{i} - (b + (c*x{i})))^2");
    }
    assert_eq!(read(&many).unwrap().items.len(), 10_000);
    // As many errors as the file has lines.
    assert!(read(&"let a = = 1\n".repeat(20_000)).is_err());
    assert!(read(&"§\n".repeat(20_000)).is_err());
}

#[test]
fn no_text_is_a_surprise() {
    for text in mutated(CIRCULATION, 20_000) {
        if let Err(mistakes) = read(&text) {
            assert!(!mistakes.is_empty());
            for mistake in mistakes {
                let span = mistake.labels[0].span;
                assert!(!mistake.message.is_empty());
                assert!(text.get(span.start as usize..span.end as usize).is_some(), "{mistake:?}");
            }
        }
    }
}

#[test]
fn parts_are_read_and_printed() {
    let text = "model m\nimport \"pump.dgd\"\npart pump: subsea_pump(c0 = 275 [m], flow = static, motor.k = 2*3)\n\
                part line: return_line\npump.q = line.q\nlet p = pump.dp + pump.f(line.q)\n\
                equation e: der(pump.h) = pump.motor.w\noutput pump.h [m]\n";
    let ast = read(text).expect("it can be read");
    assert_eq!(print(&ast), text);
    assert_eq!(codes("part a: b()"), Vec::<String>::new());
}
