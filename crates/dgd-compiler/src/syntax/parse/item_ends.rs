//! Finds the ends of items among tokens.

use super::item::is_keyword;
use super::lexical::{RESERVED, Token, TokenKind};

/// For every token, whether it is a line end that ends an item.
///
/// An item continues while a parenthesis is open and when a line ends in a comma, a colon or an operator. It does not
/// continue into a line that can only begin an item, so that a forgotten parenthesis is a single error.
pub(crate) fn item_ends(tokens: &[Token], source: &str) -> Vec<bool> {
    let is_code = |token: &Token| {
        !matches!(token.kind, TokenKind::Newline | TokenKind::Comment | TokenKind::Doc)
    };
    let code: Vec<usize> = (0..tokens.len()).filter(|&i| is_code(&tokens[i])).collect();
    // Amount of code already processed.
    let mut passed = 0;
    let mut ends = vec![false; tokens.len()];
    let mut open = 0_usize;
    let mut goes_on = false;
    for (i, token) in tokens.iter().enumerate() {
        if token.kind == TokenKind::Newline {
            let mut ahead = code[passed..].iter().map(|&i| tokens[i]);
            ends[i] = match (ahead.next(), ahead.next()) {
                (None, _) => true,
                (Some(first), second) => {
                    !(goes_on || open > 0) || begins_item(first, second, source)
                }
            };
            if ends[i] {
                (open, goes_on) = (0, false);
            }
        } else if is_code(token) {
            passed += 1;
            goes_on = continues(token.kind, token.text(source));
            match token.kind {
                TokenKind::Open => open += 1,
                TokenKind::Close => open = open.saturating_sub(1),
                // Brackets opened inside a block do not extend beyond it.
                TokenKind::OpenBrace | TokenKind::CloseBrace => open = 0,
                _ => {}
            }
        }
    }
    ends
}

/// Whether an item continues after a line that ends in this token.
fn continues(kind: TokenKind, text: &str) -> bool {
    match kind {
        TokenKind::Plus
        | TokenKind::Minus
        | TokenKind::Star
        | TokenKind::Slash
        | TokenKind::Caret
        | TokenKind::Equal
        | TokenKind::Less
        | TokenKind::LessEqual
        | TokenKind::Greater
        | TokenKind::GreaterEqual
        | TokenKind::Comma
        | TokenKind::Colon => true,
        TokenKind::Name => RESERVED.contains(&text),
        TokenKind::Number
        | TokenKind::Text
        | TokenKind::Unit
        | TokenKind::Index
        | TokenKind::Open
        | TokenKind::Close
        | TokenKind::OpenBrace
        | TokenKind::CloseBrace
        | TokenKind::Prime
        | TokenKind::Range
        | TokenKind::Dot
        | TokenKind::Arrow
        | TokenKind::Doc
        | TokenKind::Comment
        | TokenKind::Newline
        | TokenKind::Invalid => false,
    }
}

/// Whether two tokens are a keyword and a name, which cannot continue an expression.
pub(super) fn begins_item(first: Token, second: Option<Token>, source: &str) -> bool {
    first.kind == TokenKind::Name
        && is_keyword(first.text(source))
        && second.is_some_and(|second| match second.kind {
            TokenKind::Name => !RESERVED.contains(&second.text(source)),
            TokenKind::Text => true,
            _ => false,
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::Diagnostics;
    use crate::source::{SourceMap, SourceText};
    use crate::syntax::parse::lexical::tokens;

    #[test]
    fn items_end_with_their_line_unless_something_is_open() {
        for (text, expected) in [
            ("let a = 1\nlet b = 2\n", 2),
            ("let a = (1\n + 2)\n", 1),
            ("let a = 1 +\n 2\n", 1),
            ("let a = 1 + # why\n\n # what\n 2\n", 1),
            ("let a = if b > 1 then\n 1 else\n 2\n", 1),
            ("parameter a = 1 in 0 ..\nlet b = 2\n", 2),
            ("parameter a = 1 in 0 .. 1,\n log\n", 1),
            ("equation a:\n b = c\n", 1),
            ("let a = (1\nlet b = 2\n", 2),
            ("let a = 1 +\nlet b = 2\n", 2),
            ("let a = (1 +\nstate)\n", 1),
            ("let a = 1\r\nlet b = 2\r\n", 2),
        ] {
            let mut sources = SourceMap::default();
            let id = sources.add(SourceText { name: "test".into(), text: text.into() });
            let tokens = tokens(id, &sources, &mut Diagnostics::default());
            let ends = item_ends(&tokens, text);
            assert_eq!(ends.iter().filter(|&&end| end).count(), expected, "{text}");
        }
    }
}
