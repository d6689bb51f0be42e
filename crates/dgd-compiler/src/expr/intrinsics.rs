//! The functions of the language, one entry each.
//!
//! An entry contains everything about its function. The resolver, the unit checker, the differentiator, the
//! interpreter, the code generator and the documentation read this table; none of them names a function.

use dgd_signature::special;

use super::graph::{Comparison, ExprGraph, ExprId};

/// A function of the language.
pub struct Intrinsic {
    /// Spelling in `.dgd` source. `^` also has an entry, but is not written as a call.
    pub name: &'static str,
    /// Its effect on the units of its arguments.
    pub unit_rule: UnitRule,
    /// Its definition.
    pub definition: IntrinsicDefinition,
    /// Points inside the domain at which the tests compare value and derivative.
    pub sample_points: &'static [[f64; 3]],
    /// One line for the reference.
    pub doc: &'static str,
    /// Whether a model's own function of this name takes precedence: it was added to the language later than models
    /// that may have one.
    pub yields: bool,
}

/// A function that no model can redefine.
const FIRST: Intrinsic = Intrinsic {
    name: "",
    unit_rule: UnitRule::Dimensionless,
    definition: IntrinsicDefinition::Expansion(0, |_, _| {
        unreachable!("an entry says how it is computed")
    }),
    sample_points: &[],
    doc: "",
    yields: false,
};

/// A function that a model can redefine.
const LATER: Intrinsic = Intrinsic { yields: true, ..FIRST };

/// The effect of a function on units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitRule {
    /// Plain numbers in, a plain number out.
    Dimensionless,
    /// Arguments and result of the same unit.
    Same,
    /// The square root of the argument's unit.
    Root,
    /// Any unit in, a plain number out.
    Any,
    /// Arguments of one unit, a plain number out.
    Ratio,
    /// `^`: depends on the exponent's value, so the resolver handles it.
    Power,
}

/// The definition of a function.
pub enum IntrinsicDefinition {
    /// A machine function of one argument.
    One {
        /// The machine instructions that compute it without a call, if there are any.
        instruction: Option<Instruction>,
        /// Value at a number.
        value: fn(f64) -> f64,
        /// df/dx at the expression x.
        derivative: fn(&mut ExprGraph, ExprId) -> ExprId,
        /// Function that generated code calls; the same bits as `value`.
        rust_path: &'static str,
    },
    /// A machine function of two arguments.
    Two {
        /// Value at two numbers.
        value: fn(f64, f64) -> f64,
        /// (∂f/∂x, ∂f/∂y) at the expressions x, y.
        derivative: fn(&mut ExprGraph, ExprId, ExprId) -> [ExprId; 2],
        /// Function that generated code calls; the same bits as `value`.
        rust_path: &'static str,
    },
    /// An expansion into other expressions, with its number of arguments.
    Expansion(usize, fn(&mut ExprGraph, &[ExprId]) -> ExprId),
}

/// A function that takes one or a few instructions and is exact or correctly rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instruction {
    /// √x
    SquareRoot,
    /// |x|
    Absolute,
    /// −1, 0 or 1; x itself if it is a zero or NaN.
    Sign,
}

impl IntrinsicDefinition {
    /// Number of arguments.
    pub fn arity(&self) -> usize {
        match self {
            IntrinsicDefinition::One { .. } => 1,
            IntrinsicDefinition::Two { .. } => 2,
            IntrinsicDefinition::Expansion(arity, _) => *arity,
        }
    }
}

/// A row of [`INTRINSICS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct IntrinsicId(u16);

impl IntrinsicId {
    /// The function of this name.
    pub fn find(name: &str) -> Option<IntrinsicId> {
        let position = INTRINSICS.iter().position(|intrinsic| intrinsic.name == name)?;
        u16::try_from(position).ok().map(IntrinsicId)
    }

    /// The entry for a name the compiler itself uses.
    pub(crate) fn named(name: &str) -> IntrinsicId {
        Self::find(name).unwrap_or_else(|| unreachable!("`{name}` is in the table"))
    }

    /// Its entry.
    pub fn get(self) -> &'static Intrinsic {
        &INTRINSICS[self.0 as usize]
    }

    /// Value of a function of one argument.
    pub fn value1(self, x: f64) -> f64 {
        match self.get().definition {
            IntrinsicDefinition::One { value, .. } => value(x),
            IntrinsicDefinition::Two { .. } | IntrinsicDefinition::Expansion(..) => {
                unreachable!("`{}` has two arguments", self.get().name)
            }
        }
    }

    /// Value of a function of two arguments.
    pub fn value2(self, x: f64, y: f64) -> f64 {
        match self.get().definition {
            IntrinsicDefinition::Two { value, .. } => value(x, y),
            IntrinsicDefinition::One { .. } | IntrinsicDefinition::Expansion(..) => {
                unreachable!("`{}` is no machine function of two arguments", self.get().name)
            }
        }
    }
}

/// −1, 0 or 1; NaN stays NaN.
fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        x
    }
}

macro_rules! path {
    ($name:literal) => {
        concat!("::core::primitive::f64::", $name)
    };
}

/// THE table of functions.
pub static INTRINSICS: &[Intrinsic] = &[
    Intrinsic {
        name: "^",
        unit_rule: UnitRule::Power,
        definition: IntrinsicDefinition::Two {
            value: f64::powf,
            // ∂(x^y)/∂x = y x^(y−1);  ∂(x^y)/∂y = x^y ln x, and 0 at x = 0
            derivative: |g, x, y| {
                let one = g.constant(1.0);
                let lower = g.subtract(y, one);
                let power = g.power(x, lower);
                let to_x = g.multiply(y, power);
                let value = g.power(x, y);
                let zero = g.constant(0.0);
                let log = g.call1("log", x);
                let positive = g.compare(Comparison::Greater, x, zero);
                let product = g.multiply(value, log);
                let to_y = g.select(positive, product, zero);
                [to_x, to_y]
            },
            rust_path: "::dgd::__runtime::math::power",
        },
        sample_points: &[[0.3, 2.0, 0.0], [2.0, 0.5, 0.0], [1.7, -1.3, 0.0], [0.9, 3.0, 0.0]],
        doc: "x to the power y; 0^y is 0 for y > 0",
        ..FIRST
    },
    Intrinsic {
        name: "sqrt",
        unit_rule: UnitRule::Root,
        definition: IntrinsicDefinition::One {
            instruction: Some(Instruction::SquareRoot),
            value: f64::sqrt,
            // 1/(2 √x)
            derivative: |g, x| {
                let root = g.call1("sqrt", x);
                let half = g.constant(0.5);
                g.divide(half, root)
            },
            rust_path: path!("sqrt"),
        },
        sample_points: &[[0.2, 0.0, 0.0], [9.0, 0.0, 0.0]],
        doc: "square root",
        ..FIRST
    },
    Intrinsic {
        name: "exp",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::exp,
            derivative: |g, x| g.call1("exp", x),
            rust_path: path!("exp"),
        },
        sample_points: &[[-2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [3.0, 0.0, 0.0]],
        doc: "exponential",
        ..FIRST
    },
    Intrinsic {
        name: "log",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::ln,
            derivative: |g, x| {
                let one = g.constant(1.0);
                g.divide(one, x)
            },
            rust_path: path!("ln"),
        },
        sample_points: &[[0.1, 0.0, 0.0], [5.0, 0.0, 0.0]],
        doc: "natural logarithm",
        ..FIRST
    },
    Intrinsic {
        name: "log10",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::log10,
            // 1/(x ln 10)
            derivative: |g, x| {
                let factor = g.constant(std::f64::consts::LOG10_E);
                g.divide(factor, x)
            },
            rust_path: path!("log10"),
        },
        sample_points: &[[0.1, 0.0, 0.0], [5.0, 0.0, 0.0]],
        doc: "decimal logarithm",
        ..FIRST
    },
    Intrinsic {
        name: "sin",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::sin,
            derivative: |g, x| g.call1("cos", x),
            rust_path: path!("sin"),
        },
        sample_points: &[[-1.0, 0.0, 0.0], [0.4, 0.0, 0.0], [9.0, 0.0, 0.0]],
        doc: "sine of an angle in rad",
        ..FIRST
    },
    Intrinsic {
        name: "cos",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::cos,
            derivative: |g, x| {
                let sin = g.call1("sin", x);
                g.negate(sin)
            },
            rust_path: path!("cos"),
        },
        sample_points: &[[-1.0, 0.0, 0.0], [0.4, 0.0, 0.0], [9.0, 0.0, 0.0]],
        doc: "cosine of an angle in rad",
        ..FIRST
    },
    Intrinsic {
        name: "tan",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::tan,
            // 1 + tan² x
            derivative: |g, x| {
                let tan = g.call1("tan", x);
                let square = g.multiply(tan, tan);
                let one = g.constant(1.0);
                g.add(one, square)
            },
            rust_path: path!("tan"),
        },
        sample_points: &[[-1.0, 0.0, 0.0], [0.4, 0.0, 0.0]],
        doc: "tangent of an angle in rad",
        ..FIRST
    },
    Intrinsic {
        name: "asin",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::asin,
            // 1/√(1 − x²)
            derivative: |g, x| {
                let root = root_of_one_minus_square(g, x);
                let one = g.constant(1.0);
                g.divide(one, root)
            },
            rust_path: path!("asin"),
        },
        sample_points: &[[-0.6, 0.0, 0.0], [0.3, 0.0, 0.0]],
        doc: "inverse sine, in rad",
        ..FIRST
    },
    Intrinsic {
        name: "acos",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::acos,
            // −1/√(1 − x²)
            derivative: |g, x| {
                let root = root_of_one_minus_square(g, x);
                let minus_one = g.constant(-1.0);
                g.divide(minus_one, root)
            },
            rust_path: path!("acos"),
        },
        sample_points: &[[-0.6, 0.0, 0.0], [0.3, 0.0, 0.0]],
        doc: "inverse cosine, in rad",
        ..FIRST
    },
    Intrinsic {
        name: "atan",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::atan,
            // 1/(1 + x²)
            derivative: |g, x| {
                let square = g.multiply(x, x);
                let one = g.constant(1.0);
                let sum = g.add(one, square);
                g.divide(one, sum)
            },
            rust_path: path!("atan"),
        },
        sample_points: &[[-3.0, 0.0, 0.0], [0.3, 0.0, 0.0]],
        doc: "inverse tangent, in rad",
        ..FIRST
    },
    Intrinsic {
        name: "atan2",
        unit_rule: UnitRule::Ratio,
        definition: IntrinsicDefinition::Two {
            value: f64::atan2,
            // ∂/∂y = x/(x² + y²), ∂/∂x = −y/(x² + y²) for atan2(y, x)
            derivative: |g, y, x| {
                let x2 = g.multiply(x, x);
                let y2 = g.multiply(y, y);
                let sum = g.add(x2, y2);
                let to_y = g.divide(x, sum);
                let minus_y = g.negate(y);
                [to_y, g.divide(minus_y, sum)]
            },
            rust_path: path!("atan2"),
        },
        sample_points: &[[1.0, 2.0, 0.0], [-0.5, -1.5, 0.0], [2.0, -0.3, 0.0]],
        doc: "angle of the point (second, first argument), in rad",
        ..FIRST
    },
    Intrinsic {
        name: "sinh",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::sinh,
            derivative: |g, x| g.call1("cosh", x),
            rust_path: path!("sinh"),
        },
        sample_points: &[[-1.0, 0.0, 0.0], [0.4, 0.0, 0.0]],
        doc: "hyperbolic sine",
        ..FIRST
    },
    Intrinsic {
        name: "cosh",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::cosh,
            derivative: |g, x| g.call1("sinh", x),
            rust_path: path!("cosh"),
        },
        sample_points: &[[-1.0, 0.0, 0.0], [0.4, 0.0, 0.0]],
        doc: "hyperbolic cosine",
        ..FIRST
    },
    Intrinsic {
        name: "tanh",
        unit_rule: UnitRule::Dimensionless,
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::tanh,
            // 1 − tanh² x
            derivative: |g, x| {
                let tanh = g.call1("tanh", x);
                let square = g.multiply(tanh, tanh);
                let one = g.constant(1.0);
                g.subtract(one, square)
            },
            rust_path: path!("tanh"),
        },
        sample_points: &[[-3.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.7, 0.0, 0.0]],
        doc: "hyperbolic tangent",
        ..FIRST
    },
    Intrinsic {
        name: "abs",
        unit_rule: UnitRule::Same,
        definition: IntrinsicDefinition::One {
            instruction: Some(Instruction::Absolute),
            value: f64::abs,
            derivative: |g, x| g.call1("sign", x),
            rust_path: path!("abs"),
        },
        sample_points: &[[-3.0, 0.0, 0.0], [0.7, 0.0, 0.0]],
        doc: "absolute value",
        ..FIRST
    },
    Intrinsic {
        name: "sign",
        unit_rule: UnitRule::Any,
        definition: IntrinsicDefinition::One {
            instruction: Some(Instruction::Sign),
            value: sign,
            derivative: |g, _| g.constant(0.0),
            rust_path: "::dgd::__runtime::math::sign",
        },
        sample_points: &[[-3.0, 0.0, 0.0], [0.7, 0.0, 0.0]],
        doc: "-1, 0 or 1",
        ..FIRST
    },
    Intrinsic {
        name: "min",
        unit_rule: UnitRule::Same,
        definition: IntrinsicDefinition::Expansion(2, |g, of| smaller(g, of[0], of[1])),
        sample_points: &[[-3.0, 0.5, 0.0], [0.7, 0.2, 0.0]],
        doc: "the smaller of two",
        ..FIRST
    },
    Intrinsic {
        name: "max",
        unit_rule: UnitRule::Same,
        definition: IntrinsicDefinition::Expansion(2, |g, of| larger(g, of[0], of[1])),
        sample_points: &[[-3.0, 0.5, 0.0], [0.7, 0.2, 0.0]],
        doc: "the larger of two",
        ..FIRST
    },
    Intrinsic {
        name: "complementary",
        unit_rule: UnitRule::Any,
        definition: IntrinsicDefinition::Expansion(2, |g, of| smaller(g, of[0], of[1])),
        sample_points: &[[-3.0, 0.5, 0.0], [0.7, 0.2, 0.0]],
        doc: "0 where neither is below zero and one of them is zero, as the current and the blocked voltage of an ideal diode; else the smaller of two, in SI units",
        ..LATER
    },
    Intrinsic {
        name: "clamp",
        unit_rule: UnitRule::Same,
        definition: IntrinsicDefinition::Expansion(3, |g, of| {
            let from_below = larger(g, of[0], of[1]);
            smaller(g, from_below, of[2])
        }),
        sample_points: &[[-3.0, 0.5, 2.0], [0.7, 0.2, 2.0], [5.0, 0.2, 2.0]],
        doc: "the first, but at least the second and at most the third",
        ..LATER
    },
    Intrinsic {
        name: "floor",
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: f64::floor,
            derivative: |g, _| g.constant(0.0),
            rust_path: path!("floor"),
        },
        sample_points: &[[-1.3, 0.0, 0.0], [2.7, 0.0, 0.0]],
        doc: "the largest whole number that is not above",
        ..LATER
    },
    Intrinsic {
        name: "ceil",
        definition: IntrinsicDefinition::Expansion(1, |g, of| {
            let minus = g.negate(of[0]);
            let floor = g.call1("floor", minus);
            g.negate(floor)
        }),
        sample_points: &[[-1.3, 0.0, 0.0], [2.7, 0.0, 0.0]],
        doc: "the smallest whole number that is not below",
        ..LATER
    },
    Intrinsic {
        name: "round",
        definition: IntrinsicDefinition::Expansion(1, |g, of| {
            let half = g.constant(0.5);
            let above = g.add(of[0], half);
            g.call1("floor", above)
        }),
        sample_points: &[[-1.3, 0.0, 0.0], [2.7, 0.0, 0.0]],
        doc: "the nearest whole number; of two as near the larger",
        ..LATER
    },
    Intrinsic {
        name: "mod",
        unit_rule: UnitRule::Same,
        // x − y ⌊x/y⌋
        definition: IntrinsicDefinition::Expansion(2, |g, of| {
            let quotient = g.divide(of[0], of[1]);
            let times = g.call1("floor", quotient);
            let whole = g.multiply(of[1], times);
            g.subtract(of[0], whole)
        }),
        sample_points: &[[7.3, 2.0, 0.0], [-1.3, 2.0, 0.0], [1.3, -0.7, 0.0]],
        doc: "what is left of the first by whole multiples of the second, with the sign of the second",
        ..LATER
    },
    Intrinsic {
        name: "hypot",
        unit_rule: UnitRule::Same,
        definition: IntrinsicDefinition::Two {
            value: f64::hypot,
            // x/√(x² + y²) and y/√(x² + y²); 0 at the origin, where it has no derivative
            derivative: |g, x, y| {
                let length = g.call(IntrinsicId::named("hypot"), &[x, y]);
                let zero = g.constant(0.0);
                let positive = g.compare(Comparison::Greater, length, zero);
                [x, y].map(|leg| {
                    let share = g.divide(leg, length);
                    g.select(positive, share, zero)
                })
            },
            rust_path: path!("hypot"),
        },
        sample_points: &[[3.0, 4.0, 0.0], [-0.3, 0.1, 0.0]],
        doc: "length of the hypotenuse: the root of the sum of the squares",
        ..LATER
    },
    Intrinsic {
        name: "smoothstep",
        unit_rule: UnitRule::Ratio,
        // 0 for s ≤ 0, 1 for s ≥ 1, between them s² (3 − 2 s), with s = (x − a)/(b − a)
        definition: IntrinsicDefinition::Expansion(3, |g, of| {
            let [a, b, x] = [of[0], of[1], of[2]];
            let (zero, one) = (g.constant(0.0), g.constant(1.0));
            let (two, three) = (g.constant(2.0), g.constant(3.0));
            let (passed, width) = (g.subtract(x, a), g.subtract(b, a));
            let s = g.divide(passed, width);
            let twice = g.multiply(two, s);
            let rest = g.subtract(three, twice);
            let square = g.multiply(s, s);
            let between = g.multiply(square, rest);
            let (before, behind) = (
                g.compare(Comparison::LessEqual, s, zero),
                g.compare(Comparison::GreaterEqual, s, one),
            );
            let upper = g.select(behind, one, between);
            g.select(before, zero, upper)
        }),
        sample_points: &[[1.0, 3.0, 0.5], [1.0, 3.0, 1.7], [3.0, 1.0, 1.7], [1.0, 3.0, 3.5]],
        doc: "0 up to the first, 1 from the second on, of the third; between them the cubic with slopes 0 at both",
        ..LATER
    },
    Intrinsic {
        name: "erf",
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: special::erf,
            derivative: |g, x| {
                let factor = std::f64::consts::FRAC_2_SQRT_PI;
                gaussian(g, factor, x)
            },
            rust_path: "::dgd::__runtime::special::erf",
        },
        sample_points: &[[-1.3, 0.0, 0.0], [0.0, 0.0, 0.0], [0.7, 0.0, 0.0], [2.5, 0.0, 0.0]],
        doc: "error function",
        ..LATER
    },
    Intrinsic {
        name: "erfc",
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: special::erfc,
            derivative: |g, x| {
                let factor = -std::f64::consts::FRAC_2_SQRT_PI;
                gaussian(g, factor, x)
            },
            rust_path: "::dgd::__runtime::special::erfc",
        },
        sample_points: &[[-1.3, 0.0, 0.0], [0.0, 0.0, 0.0], [0.7, 0.0, 0.0], [2.5, 0.0, 0.0]],
        doc: "1 - erf(x), without cancellation",
        ..LATER
    },
    Intrinsic {
        name: "lgamma",
        definition: IntrinsicDefinition::One {
            instruction: None,
            value: special::lgamma,
            derivative: |g, x| {
                let zero = g.constant(0.0);
                g.call(IntrinsicId::named("polygamma"), &[zero, x])
            },
            rust_path: "::dgd::__runtime::special::lgamma",
        },
        sample_points: &[[0.3, 0.0, 0.0], [1.4616, 0.0, 0.0], [7.5, 0.0, 0.0]],
        doc: "natural logarithm of the gamma function, of numbers above zero",
        ..LATER
    },
    Intrinsic {
        name: "polygamma",
        definition: IntrinsicDefinition::Two {
            value: special::polygamma,
            // The order is a whole number.
            derivative: |g, n, x| {
                let (zero, one) = (g.constant(0.0), g.constant(1.0));
                let next = g.add(n, one);
                [zero, g.call(IntrinsicId::named("polygamma"), &[next, x])]
            },
            rust_path: "::dgd::__runtime::special::polygamma",
        },
        // The order is a whole number, so differences do not apply.
        sample_points: &[],
        doc: "derivative of `lgamma` of the order that the first, a whole number, and one make: polygamma(0, x) is the digamma function",
        ..LATER
    },
];

fn smaller(g: &mut ExprGraph, a: ExprId, b: ExprId) -> ExprId {
    let first = g.compare(Comparison::Less, a, b);
    g.select(first, a, b)
}

fn larger(g: &mut ExprGraph, a: ExprId, b: ExprId) -> ExprId {
    let first = g.compare(Comparison::Greater, a, b);
    g.select(first, a, b)
}

/// c exp(−x²)
fn gaussian(g: &mut ExprGraph, factor: f64, x: ExprId) -> ExprId {
    let square = g.multiply(x, x);
    let minus = g.negate(square);
    let bell = g.call1("exp", minus);
    let factor = g.constant(factor);
    g.multiply(factor, bell)
}

/// √(1 − x²)
fn root_of_one_minus_square(g: &mut ExprGraph, x: ExprId) -> ExprId {
    let square = g.multiply(x, x);
    let one = g.constant(1.0);
    let rest = g.subtract(one, square);
    g.call1("sqrt", rest)
}

#[cfg(test)]
mod tests {
    use super::super::graph::Symbol;
    use super::*;

    #[test]
    fn every_derivative_agrees_with_a_central_difference() {
        for intrinsic in INTRINSICS {
            let id = IntrinsicId::named(intrinsic.name);
            let mut g = ExprGraph::default();
            let symbols = [Symbol::Unknown(0), Symbol::Unknown(1), Symbol::Unknown(2)];
            let arguments = symbols.map(|s| g.symbol(s));
            let arity = intrinsic.definition.arity();
            let call = g.call(id, &arguments[..arity]);
            for &point in intrinsic.sample_points {
                let at = |g: &ExprGraph, e, point: [f64; 3]| {
                    let value = |s| symbols.iter().position(|x| *x == s).map(|k| point[k]);
                    g.evaluate(e, &|s| value(s).unwrap_or(f64::NAN))
                };
                let gradient = g.gradient(call, |s| symbols.iter().position(|x| *x == s));
                for (k, x) in point.iter().enumerate().take(arity) {
                    // Fourth-order central difference: error h⁴ f⁗/30 + ε f/h ≈ 1e-11 at h = 1e-3.
                    let h = 1e-3;
                    let shifted = |d: f64| {
                        let mut p = point;
                        p[k] = x + d;
                        at(&g, call, p)
                    };
                    let difference = (8.0 * (shifted(h) - shifted(-h))
                        - (shifted(2.0 * h) - shifted(-2.0 * h)))
                        / (12.0 * h);
                    let derivative = gradient
                        .iter()
                        .find(|(i, _)| *i == k)
                        .map_or(0.0, |(_, e)| at(&g, *e, point));
                    assert!(
                        (derivative - difference).abs() <= 1e-8 * derivative.abs().max(1.0),
                        "d {}({point:?})/d argument {k}: {derivative}, difference {difference}",
                        intrinsic.name
                    );
                }
            }
        }
    }

    #[test]
    fn zero_to_a_parameter_is_flat_in_the_parameter() {
        let mut g = ExprGraph::default();
        let (x, k) = (g.symbol(Symbol::Input(0)), g.symbol(Symbol::Parameter(0)));
        let power = g.power(x, k);
        let gradient = g.gradient(power, |s| (s == Symbol::Parameter(0)).then_some(0));
        let at = |s| if s == Symbol::Input(0) { 0.0 } else { 1.7 };
        assert_eq!(g.evaluate(power, &at), 0.0);
        assert_eq!(g.evaluate(gradient[0].1, &at), 0.0);
    }
}
