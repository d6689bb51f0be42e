//! Texts before and after layout, and texts that are not changed.

use super::super::tests::{CIRCULATION, mutated};
use super::*;
use crate::source::SourceText;

fn laid_out(text: &str) -> Result<String, ErrorReported> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "test".into(), text: text.into() });
    format(id, &sources, &mut Diagnostics::default())
}

fn token_texts(text: &str) -> Vec<String> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "test".into(), text: text.into() });
    lexical::tokens(id, &sources, &mut Diagnostics::default())
        .into_iter()
        .filter(|token| token.kind != TokenKind::Newline)
        .map(|token| token.text(text).trim_end().to_owned())
        .collect()
}

#[test]
fn the_example_keeps_its_looks() {
    assert_eq!(laid_out(CIRCULATION).as_deref(), Ok(CIRCULATION));
}

#[test]
fn blanks_become_canonical() {
    for (text, expected) in [
        ("let  a=1+2 -3", "let a = 1 + 2 - 3\n"),
        ("let a = b* c/d ^ 2", "let a = b * c/d^2\n"),
        ("let a = - b-(-c)", "let a = -b - (-c)\n"),
        ("let a = max( b ,c )", "let a = max(b, c)\n"),
        ("let a = if b<1 and(c>2)then 1 else -2", "let a = if b < 1 and (c > 2) then 1 else -2\n"),
        ("parameter a=1[m] in -1..1,nominal -2", "parameter a = 1 [m]  in -1 .. 1, nominal -2\n"),
        ("input a [%] hold", "input a [%] hold\n"),
        ("equation a:b=c", "equation a: b = c\n"),
        ("for i in 1..N {\nequation m: a = b\n}", "for i in 1..N {\n  equation m: a = b\n}\n"),
        ("v  {let a=1}", "v { let a = 1 }\n"),
        ("\n\n let a = 1\n\n\n\n let b = 2\r\n\n", "let a = 1\n\nlet b = 2\n"),
        ("let a = (1 +\n2)\nlet b = 3", "let a = (1 +\n    2)\nlet b = 3\n"),
        ("let a = (\n1\n  )", "let a = (\n    1\n)\n"),
        (
            "modes m {\na->b when x falls below -1\n}",
            "modes m {\n  a -> b when x falls below -1\n}\n",
        ),
        ("", ""),
        ("# only this", "# only this\n"),
    ] {
        assert_eq!(laid_out(text).as_deref(), Ok(expected), "{text}");
    }
    assert!(laid_out("let a = $").is_err());
}

#[test]
fn declarations_of_one_kind_form_columns() {
    let text = "\
state h [m] = 50 # level
state pressure [bar] fixed
state q = 1 fixed        # flow
let a = 1
let longer = 2
variant flow {
dynamic { equation e: a = b }
static {equation e: a = c}
}
";
    let expected = "\
state h        [m]   = 50  # level
state pressure [bar]       fixed
state q              = 1   fixed  # flow
let a      = 1
let longer = 2
variant flow {
  dynamic { equation e: a = b }
  static  { equation e: a = c }
}
";
    assert_eq!(laid_out(text).as_deref(), Ok(expected));
}

#[test]
fn comments_of_a_block_have_one_column() {
    // From any columns, comments move to the leftmost one at which all fit.
    let block = |columns: [usize; 3]| {
        let lines = ["constant a  = 1", "constant bb = 22", "constant c  = 3"];
        let lines = lines.iter().zip(columns).map(|(line, column)| format!("{line:column$}# x\n"));
        lines.collect::<String>()
    };
    for (columns, column) in [([18, 18, 18], 18), ([20, 30, 25], 20), ([25, 17, 17], 18)] {
        assert_eq!(laid_out(&block(columns)), Ok(block([column; 3])));
    }
    // Lines of another kind have their own column, and so have lines after one without a comment.
    let text = "constant a = 1    # one\nlet b = a    # two\n";
    assert_eq!(laid_out(text).as_deref(), Ok(text));
    let text = "constant a = 1    # one\nconstant b = 2\nconstant c = 3      # three\n";
    assert_eq!(laid_out(text).as_deref(), Ok(text));
}

#[test]
fn tokens_stay_and_a_second_time_changes_nothing() {
    for text in mutated(CIRCULATION, 2000) {
        let Ok(once) = laid_out(&text) else { continue };
        assert_eq!(token_texts(&once), token_texts(&text), "{text}");
        assert_eq!(laid_out(&once).as_ref(), Ok(&once), "{text}");
    }
}

#[test]
fn arrays_and_sums_have_their_ranges_close() {
    let text = "\
state T[1..2][1..N] [K]=3
parameter kk[1..3] =( 1,2 ,3 ) in 0..9
parameter k = 2 in 0 .. 3
output a=sum( T[i][j]*2 for i in 1..2,j in 1 .. N-1 ) - 1
for i in 1..2,j in 2..N { equation h[i] [j]: a=b }
";
    let expected = "\
state T[1..2][1..N] [K] = 3
parameter kk[1..3] = (1, 2, 3)  in 0 .. 9
parameter k        = 2          in 0 .. 3
output a = sum(T[i][j]*2 for i in 1..2, j in 1 .. N-1) - 1
for i in 1..2, j in 2..N { equation h[i] [j]: a = b }
";
    assert_eq!(laid_out(text).as_deref(), Ok(expected));
}

#[test]
fn parts_keep_their_points_and_colons_close() {
    let text = "part  pump :subsea_pump( c0=275[m],flow = static )\npump.q  =q_ssp\n";
    let expected = "part pump: subsea_pump(c0 = 275 [m], flow = static)\npump.q = q_ssp\n";
    assert_eq!(laid_out(text).as_deref(), Ok(expected));
    let text = "output a.b.h [m] = 2\noutput long_name [cm] = 3\n";
    let expected = "output a.b.h     [m]  = 2\noutput long_name [cm] = 3\n";
    assert_eq!(laid_out(text).as_deref(), Ok(expected));
}
