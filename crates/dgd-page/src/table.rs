//! Tables with sortable columns.

use std::fmt::Write;

use crate::markup::{Markup, escaped};

/// Length in bytes from which a text cell counts as a sentence, which gets more room on narrow screens.
const SENTENCE: usize = 40;

/// A table.
#[derive(Debug, Clone, Default)]
pub struct PageTable {
    /// Its caption, for readers who cannot see its context.
    pub caption: String,
    /// Heads of the columns.
    pub head: Vec<Markup>,
    /// Rows, each with a cell for each column; the first one names the row.
    pub rows: Vec<Vec<PageCell>>,
}

/// A cell of a table.
#[derive(Debug, Clone, Default)]
pub struct PageCell {
    content: Markup,
    /// The number by which it is sorted, if any.
    value: Option<f64>,
    is_number: bool,
}

impl PageCell {
    /// Words.
    pub fn text(content: Markup) -> PageCell {
        PageCell { content, value: None, is_number: false }
    }

    /// A number as shown, and its value; cells without a value are sorted last.
    pub fn number(shown: &str, value: Option<f64>) -> PageCell {
        let value = value.filter(|value| value.is_finite());
        PageCell { content: Markup::text(shown), value, is_number: true }
    }
}

/// A coloured table of numbers from −1 to 1 for each pair of names, with a dash where there is none.
pub fn heat_map(
    caption: &str,
    names: &[String],
    value: impl Fn(usize, usize) -> Option<f64>,
) -> Markup {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_heat_map(&mut text, caption, names, value);
    Markup::trusted(text)
}

fn write_heat_map(
    text: &mut String,
    caption: &str,
    names: &[String],
    value: impl Fn(usize, usize) -> Option<f64>,
) -> std::fmt::Result {
    let caption = escaped(caption);
    writeln!(
        text,
        "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"{caption}\">\n\
         <table class=\"heat\">\n<caption class=\"unseen\">{caption}</caption>\n<thead><tr><td></td>"
    )?;
    for name in names {
        write!(text, "<th scope=\"col\">{}</th>", Markup::code(name))?;
    }
    writeln!(text, "</tr></thead>\n<tbody>")?;
    for (i, name) in names.iter().enumerate() {
        write!(text, "<tr><th scope=\"row\">{}</th>", Markup::code(name))?;
        for j in 0..names.len() {
            match value(i, j).filter(|value| value.is_finite()) {
                None => write!(text, "<td>–</td>")?,
                Some(value) => {
                    let shown = format!("{value:.2}").replace('-', "−");
                    write!(text, "<td{}>{shown}</td>", shade(value, i == j))?;
                }
            }
        }
        writeln!(text, "</tr>")?;
    }
    writeln!(text, "</tbody>\n</table>\n</div>")
}

/// The CSS class of a number's colour: empty for numbers close to zero, and for the diagonal.
fn shade(value: f64, is_diagonal: bool) -> String {
    let depth = [0.3, 0.7, 0.95].iter().filter(|limit| value.abs() > **limit).count();
    let sign = if value < 0.0 { 'n' } else { 'p' };
    match depth {
        0 => String::new(),
        _ if is_diagonal => String::new(),
        _ => format!(" class=\"{sign}{depth}\""),
    }
}

impl PageTable {
    /// A table with heads of plain text.
    pub fn new(caption: &str, head: &[&str]) -> PageTable {
        PageTable {
            caption: caption.to_owned(),
            head: head.iter().map(|head| Markup::text(head)).collect(),
            rows: Vec::new(),
        }
    }

    /// The table as a piece of a page; empty without rows.
    pub fn to_markup(&self) -> Markup {
        if self.rows.is_empty() {
            return Markup::default();
        }
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        Markup::trusted(text)
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        let caption = escaped(&self.caption);
        writeln!(
            text,
            "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"{caption}\">"
        )?;
        writeln!(text, "<table class=\"wide sortable\">")?;
        writeln!(text, "<caption class=\"unseen\">{caption}</caption>\n<thead><tr>")?;
        for (j, head) in self.head.iter().enumerate() {
            let is_number = self.rows.iter().any(|row| row.get(j).is_some_and(|c| c.is_number));
            let class = if is_number { " class=\"number\"" } else { "" };
            // A column without a head contains remarks.
            let tag = if head.is_empty() { "td" } else { "th scope=\"col\"" };
            let end = if head.is_empty() { "td" } else { "th" };
            write!(text, "<{tag}{class}>{head}</{end}>")?;
        }
        writeln!(text, "</tr></thead>\n<tbody>")?;
        for row in &self.rows {
            write!(text, "<tr>")?;
            for (j, cell) in row.iter().enumerate() {
                let sort = cell.value.map_or_else(String::new, |v| format!(" data-sort=\"{v:e}\""));
                let content = &cell.content;
                let class = if cell.is_number {
                    " class=\"number\""
                } else if content.as_str().len() > SENTENCE {
                    " class=\"long\""
                } else {
                    ""
                };
                if j == 0 {
                    write!(text, "<th scope=\"row\"{class}{sort}>{content}</th>")?;
                } else {
                    write!(text, "<td{class}{sort}>{content}</td>")?;
                }
            }
            writeln!(text, "</tr>")?;
        }
        writeln!(text, "</tbody>\n</table>\n</div>")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heat_map_has_a_class_for_what_is_large() {
        let names = ["a".to_owned(), "b<".to_owned()];
        let values = [[Some(1.0), Some(-0.97)], [None, Some(0.1)]];
        let text = heat_map("how", &names, |i, j| values[i][j]).to_string();
        assert!(text.contains("<td>1.00</td><td class=\"n3\">−0.97</td>"), "{text}");
        assert!(text.contains("<td>–</td><td>0.10</td>"), "{text}");
        assert!(text.contains("<code>b&lt;</code>") && !text.contains("b<<"), "{text}");
    }

    #[test]
    fn numbers_are_sorted_by_their_value_and_words_are_escaped() {
        let mut table = PageTable::new("what \"it\" shows", &["name", "value", ""]);
        table.rows.push(vec![
            PageCell::text(Markup::code("<b>")),
            PageCell::number("(1.0 ± 0.1)·10⁸", Some(1e8)),
            PageCell::number("–", Some(f64::NAN)),
        ]);
        let sentence = "what is to be said of it is longer than a word or two";
        table.rows.push(vec![PageCell::text(Markup::text(sentence)); 2]);
        let text = table.to_markup().to_string();
        assert!(text.contains("<th scope=\"row\"><code>&lt;b&gt;</code></th>"), "{text}");
        assert!(text.contains("<td class=\"number\" data-sort=\"1e8\">(1.0 ± 0.1)·10⁸</td>"));
        assert!(text.contains("<td class=\"number\">–</td>"), "{text}");
        assert!(text.contains("<td class=\"long\">what is to be said"), "{text}");
        assert!(text.contains("aria-label=\"what &quot;it&quot; shows\""), "{text}");
        assert!(PageTable::new("nothing", &["name"]).to_markup().is_empty());
    }
}
