//! Formulas as data, operation by operation, so that a solver can evaluate them over a range as well as at a point.

mod curve;

use crate::List;

pub use curve::Curve;

/// Formulas that share their operations.
#[derive(Debug, Clone, PartialEq)]
pub struct Formulas {
    /// Operations in order, each on the values of earlier ones.
    pub operations: List<Operation>,
    /// For each formula, the operation that gives its value.
    pub results: List<u32>,
}

/// An operation. Numbers are positions of earlier operations; conditions are 1 where they hold and 0 elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operation {
    /// A number.
    Constant(f64),
    /// t.
    Time,
    /// The unknown at this position of y.
    Unknown(u32),
    /// The input at this position of u.
    Input(u32),
    /// The parameter at this position of p.
    Parameter(u32),
    /// The number at this position of z.
    Discrete(u32),
    /// −a
    Negate(u32),
    /// a + b
    Add(u32, u32),
    /// a − b
    Subtract(u32, u32),
    /// a b
    Multiply(u32, u32),
    /// a / b
    Divide(u32, u32),
    /// A function of the language, by its name.
    Call(&'static str, u32),
    /// A function of two arguments, by its name.
    Call2(&'static str, u32, u32),
    /// The curve of a table.
    Curve(&'static Curve, u32),
    /// a > b
    Above(u32, u32),
    /// a ≥ b
    NotBelow(u32, u32),
    /// a and b
    And(u32, u32),
    /// a or b
    Or(u32, u32),
    /// not a
    Not(u32),
    /// b where a holds, otherwise c.
    Select(u32, u32, u32),
}

impl Formulas {
    /// No formulas.
    pub const NONE: Self = Self { operations: List::Borrowed(&[]), results: List::Borrowed(&[]) };
}

impl Operation {
    /// Its name in the source of a generated model.
    pub fn ident(self) -> &'static str {
        match self {
            Self::Constant(..) => "Constant",
            Self::Time => "Time",
            Self::Unknown(..) => "Unknown",
            Self::Input(..) => "Input",
            Self::Parameter(..) => "Parameter",
            Self::Discrete(..) => "Discrete",
            Self::Negate(..) => "Negate",
            Self::Add(..) => "Add",
            Self::Subtract(..) => "Subtract",
            Self::Multiply(..) => "Multiply",
            Self::Divide(..) => "Divide",
            Self::Call(..) => "Call",
            Self::Call2(..) => "Call2",
            Self::Curve(..) => "Curve",
            Self::Above(..) => "Above",
            Self::NotBelow(..) => "NotBelow",
            Self::And(..) => "And",
            Self::Or(..) => "Or",
            Self::Not(..) => "Not",
            Self::Select(..) => "Select",
        }
    }

    /// The operations whose values it reads.
    pub fn operands(self) -> impl Iterator<Item = u32> {
        let [a, b, c] = match self {
            Self::Constant(_)
            | Self::Time
            | Self::Unknown(_)
            | Self::Input(_)
            | Self::Parameter(_)
            | Self::Discrete(_) => [None; 3],
            Self::Negate(a) | Self::Call(_, a) | Self::Curve(_, a) | Self::Not(a) => {
                [Some(a), None, None]
            }
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Call2(_, a, b)
            | Self::Above(a, b)
            | Self::NotBelow(a, b)
            | Self::And(a, b)
            | Self::Or(a, b) => [Some(a), Some(b), None],
            Self::Select(a, b, c) => [Some(a), Some(b), Some(c)],
        };
        [a, b, c].into_iter().flatten()
    }
}
