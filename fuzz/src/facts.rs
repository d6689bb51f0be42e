//! Known facts about a case that follow from the way its model was written, independent of any solver.

use std::fmt;

/// A value of the correct solution, written in a file as a comment: `# fact: E at 3 = 12.5 of 10`.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// An unknown or an output, or a derivative of one: `d(y)/d(k)`.
    pub of: String,
    /// Its time, s; `None` for all rows.
    pub at: Option<f64>,
    /// The value, SI.
    pub value: f64,
    /// The size to which errors are relative; 0 for a count, which is exact.
    pub size: f64,
}

/// Prefix of a line with a fact.
const BEGIN: &str = "# fact: ";

impl Fact {
    /// Parses the fact in a line, if any.
    pub(crate) fn read(line: &str) -> Option<Fact> {
        let (head, size) = line.strip_prefix(BEGIN)?.rsplit_once(" of ")?;
        let (head, value) = head.rsplit_once(" = ")?;
        let (of, at) = if let Some(of) = head.strip_suffix(" always") {
            (of, None)
        } else {
            let (of, at) = head.rsplit_once(" at ")?;
            (of, Some(at.parse().ok()?))
        };
        Some(Fact { of: of.to_owned(), at, value: value.parse().ok()?, size: size.parse().ok()? })
    }

    /// The name and the parameter of a derivative.
    pub(crate) fn derivative(&self) -> Option<(&str, &str)> {
        self.of.strip_prefix("d(")?.strip_suffix(')')?.split_once(")/d(")
    }
}

impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{BEGIN}{}", self.of)?;
        match self.at {
            Some(at) => write!(f, " at {at}")?,
            None => write!(f, " always")?,
        }
        write!(f, " = {} of {}", self.value, self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_are_read_as_they_are_written() {
        for fact in [
            Fact { of: "E".into(), at: Some(3.25), value: -1.5e-7, size: 10.0 },
            Fact { of: "d(y[1])/d(k at 2)".into(), at: None, value: 0.1, size: 0.0 },
        ] {
            assert_eq!(Fact::read(&fact.to_string()), Some(fact));
        }
        assert_eq!(Fact::read("# fact: that is none"), None);
    }
}
