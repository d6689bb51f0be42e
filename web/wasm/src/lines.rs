//! The compared lines.

use std::fmt::Write;

/// Relative tolerance, with respect to the largest number of a quantity: a few thousand roundings.
pub(crate) const CLOSE: f64 = 1e-12;

/// Lines of a case, in the order of their addition.
#[derive(Debug)]
pub(crate) struct Lines {
    text: String,
    close: f64,
}

impl Default for Lines {
    fn default() -> Self {
        Self { text: String::new(), close: CLOSE }
    }
}

impl Lines {
    /// Sets the tolerance of the numbers added from here on.
    pub(crate) fn hold_to(&mut self, close: f64) {
        self.close = close;
    }

    /// Adds a text, which must be equal everywhere.
    pub(crate) fn text(&mut self, what: &str, text: &str) {
        let one_line = text.replace(['\t', '\n'], " ");
        self.add("text", what, &one_line);
    }

    /// Adds the numbers of one quantity, with all digits.
    pub(crate) fn numbers(&mut self, what: &str, numbers: impl IntoIterator<Item = f64>) {
        let numbers: Vec<String> = numbers.into_iter().map(|x| format!("{x:e}")).collect();
        self.add(&format!("{:e}", self.close), what, &numbers.join(" "));
    }

    fn add(&mut self, kind: &str, what: &str, value: &str) {
        writeln!(self.text, "{kind}\t{what}\t{value}").expect("a String takes everything");
    }

    pub(crate) fn into_text(self) -> String {
        self.text
    }
}
