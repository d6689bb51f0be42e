//! Markup of a page, in which text from outside is escaped.

use std::fmt;

use dgd_plot::MathText;

/// A piece of a page.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Markup(String);

impl Markup {
    /// Text as it stands.
    pub fn text(text: &str) -> Markup {
        Markup(escaped(text))
    }

    /// A name in the model's or the machine's spelling.
    pub fn code(text: &str) -> Markup {
        Markup(format!("<code>{}</code>", escaped(text)))
    }

    /// A sentence in which text between backticks is code.
    pub fn prose(sentence: &str) -> Markup {
        let pieces = sentence.split('`').enumerate();
        Markup(
            pieces
                .map(
                    |(index, piece)| {
                        if index % 2 == 1 { Markup::code(piece).0 } else { escaped(piece) }
                    },
                )
                .collect(),
        )
    }

    /// Existing markup, which must not contain unescaped text from outside.
    pub fn trusted(markup: impl Into<String>) -> Markup {
        Markup(markup.into())
    }

    /// Links to another file of the same folder, whose name has only letters, digits, `_`, `-` and dots.
    #[must_use]
    pub fn linked(&self, file: &str) -> Markup {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        if file.is_empty() || !file.chars().all(is_plain) {
            return self.clone();
        }
        Markup(format!("<a href=\"{file}\">{}</a>", self.0))
    }

    /// A paragraph of it.
    #[must_use]
    pub fn paragraph(&self) -> Markup {
        Markup(format!("<p>{}</p>\n", self.0))
    }

    /// A paragraph in small print under a table or a figure.
    #[must_use]
    pub fn caption(&self) -> Markup {
        Markup(format!("<p class=\"caption\">{}</p>\n", self.0))
    }

    /// A list of such pieces.
    pub fn list(items: &[Markup]) -> Markup {
        let items: Vec<String> = items.iter().map(|item| format!("<li>{item}</li>\n")).collect();
        Markup(format!("<ul>\n{}</ul>\n", items.concat()))
    }

    /// A list of names with descriptions.
    pub fn definitions(rows: &[(Markup, Markup)]) -> Markup {
        if rows.is_empty() {
            return Markup::default();
        }
        let row = |(name, value): &(Markup, Markup)| format!("<dt>{name}</dt><dd>{value}</dd>\n");
        let rows: Vec<String> = rows.iter().map(row).collect();
        Markup(format!("<dl>\n{}</dl>\n", rows.concat()))
    }

    /// A section of the page under a heading.
    pub fn section(heading: &Markup, body: &[Markup]) -> Markup {
        let body: String = body.iter().map(|piece| piece.0.as_str()).collect();
        Markup(format!("<section>\n<h2>{heading}</h2>\n{body}</section>\n"))
    }

    /// Appends another piece.
    #[must_use]
    pub fn then(mut self, next: &Markup) -> Markup {
        self.0.push_str(&next.0);
        self
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The markup as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Markup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<&MathText> for Markup {
    fn from(text: &MathText) -> Markup {
        Markup(text.to_html())
    }
}

/// Escapes text between tags or within the quotes of an attribute.
pub(crate) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            _ => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_to_files_beside_the_page_and_nowhere_else() {
        let of = |file: &str| Markup::text("a<b").linked(file).to_string();
        assert_eq!(of("wells_2.html"), "<a href=\"wells_2.html\">a&lt;b</a>");
        for other in
            ["", "javascript:alert(1)", "//there/x", "a/b.html", "x\" onclick=\"y", "http://x"]
        {
            assert_eq!(of(other), "a&lt;b", "{other}");
        }
    }

    #[test]
    fn text_from_outside_is_escaped_and_backticks_are_code() {
        let hostile = "</script><img src=x onerror='alert(1)'>\"&";
        let safe = "&lt;/script&gt;&lt;img src=x onerror=&#39;alert(1)&#39;&gt;&quot;&amp;";
        assert_eq!(Markup::text(hostile).as_str(), safe);
        assert_eq!(Markup::code(hostile).as_str(), format!("<code>{safe}</code>"));
        assert_eq!(
            Markup::prose("of `a<b` less `c`").as_str(),
            "of <code>a&lt;b</code> less <code>c</code>"
        );
    }
}
