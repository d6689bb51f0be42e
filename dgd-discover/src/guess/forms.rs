//! The table of functions that a formula may apply to a name of a model.

/// A function of one quantity, as a factor after a coefficient.
#[derive(Debug)]
pub(crate) struct Form {
    /// The factor in the language, with `{}` for the name and `{b}` for the inner constant.
    pub text: &'static str,
    /// Its value for a quantity and an inner constant, SI.
    pub value: fn(f64, f64) -> f64,
    /// Inner constants to try, relative to the size of the quantity (its largest value); empty without one. The
    /// constant has the unit of the quantity.
    pub inner: &'static [f64],
    /// Exponent of the quantity's unit in the factor: numerator and denominator.
    pub power: (i64, i64),
    /// Values for which it is defined.
    pub domain: Domain,
    /// Complexity for a reader.
    pub complexity: u32,
    /// Whether it is tried in products of two.
    pub in_products: bool,
    /// Whether its quantity has to be a number without a unit.
    pub of_numbers: bool,
}

/// Values for which a [`Form`] is defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    /// Any values.
    All,
    /// Positive values, not close to zero.
    Positive,
    /// Values of one sign, not close to zero.
    OneSign,
}

/// Minimum distance from zero, as a fraction of the largest value, for forms that need one.
const CLOSE: f64 = 0.05;

impl Domain {
    /// Whether all values lie in it.
    pub(crate) fn holds(self, values: impl Iterator<Item = f64>) -> bool {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in values.filter(|x| x.is_finite()) {
            (least, most) = (least.min(x), most.max(x));
        }
        let is_positive = least > CLOSE * most.abs();
        match self {
            Domain::All => true,
            Domain::Positive => is_positive,
            Domain::OneSign => is_positive || -most > CLOSE * least.abs(),
        }
    }
}

/// All forms; of equivalent ones, such as x² and x|x| for positive x, the first is used.
pub(crate) static FORMS: [Form; 31] = [
    Form {
        text: "*{}",
        value: |x, _| x,
        inner: &[],
        power: (1, 1),
        domain: Domain::All,
        complexity: 1,
        in_products: true,
        of_numbers: false,
    },
    Form {
        text: "*{}^2",
        value: |x, _| x * x,
        inner: &[],
        power: (2, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: true,
        of_numbers: false,
    },
    Form {
        text: "*{}*abs({})",
        value: |x, _| x * x.abs(),
        inner: &[],
        power: (2, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: true,
        of_numbers: false,
    },
    Form {
        text: "*sqrt({})",
        value: |x, _| x.sqrt(),
        inner: &[],
        power: (1, 2),
        domain: Domain::Positive,
        complexity: 2,
        in_products: true,
        of_numbers: false,
    },
    Form {
        text: "/{}",
        value: |x, _| x.recip(),
        inner: &[],
        power: (-1, 1),
        domain: Domain::OneSign,
        complexity: 2,
        in_products: true,
        of_numbers: false,
    },
    Form {
        text: "*abs({})",
        value: |x, _| x.abs(),
        inner: &[],
        power: (1, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*max({}, 0)",
        value: |x, _| x.max(0.0),
        inner: &[],
        power: (1, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*min({}, 0)",
        value: |x, _| x.min(0.0),
        inner: &[],
        power: (1, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*sign({})*sqrt(abs({}))",
        value: |x, _| x.signum() * x.abs().sqrt(),
        inner: &[],
        power: (1, 2),
        domain: Domain::All,
        complexity: 3,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "/{}^2",
        value: |x, _| (x * x).recip(),
        inner: &[],
        power: (-2, 1),
        domain: Domain::OneSign,
        complexity: 3,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "/sqrt({})",
        value: |x, _| x.sqrt().recip(),
        inner: &[],
        power: (-1, 2),
        domain: Domain::Positive,
        complexity: 3,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*{}^3",
        value: |x, _| x * x * x,
        inner: &[],
        power: (3, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*{}*sqrt(abs({}))",
        value: |x, _| x * x.abs().sqrt(),
        inner: &[],
        power: (3, 2),
        domain: Domain::All,
        complexity: 3,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*{}^(1/3)",
        value: |x, _| x.cbrt(),
        inner: &[],
        power: (1, 3),
        domain: Domain::Positive,
        complexity: 3,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*{}^(2/3)",
        value: |x, _| x.cbrt() * x.cbrt(),
        inner: &[],
        power: (2, 3),
        domain: Domain::Positive,
        complexity: 3,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "/{}^(3/2)",
        value: |x, _| (x * x.sqrt()).recip(),
        inner: &[],
        power: (-3, 2),
        domain: Domain::Positive,
        complexity: 4,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*{}/({b} + abs({}))",
        value: |x, b| x / (b + x.abs()),
        inner: PARTS,
        power: (0, 1),
        domain: Domain::All,
        complexity: 4,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "/({b} + abs({}))",
        value: |x, b| (b + x.abs()).recip(),
        inner: PARTS,
        power: (-1, 1),
        domain: Domain::All,
        complexity: 4,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*tanh({}/{b})",
        value: |x, b| (x / b).tanh(),
        inner: PARTS,
        power: (0, 1),
        domain: Domain::All,
        complexity: 4,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*exp({}/{b})",
        value: |x, b| (x / b).exp(),
        inner: PARTS,
        power: (0, 1),
        domain: Domain::All,
        complexity: 4,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*exp(-{}/{b})",
        value: |x, b| (-x / b).exp(),
        inner: PARTS,
        power: (0, 1),
        domain: Domain::All,
        complexity: 4,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*{}^2/({b}^2 + {}^2)",
        value: |x, b| x * x / (b * b + x * x),
        inner: PARTS,
        power: (0, 1),
        domain: Domain::All,
        complexity: 5,
        in_products: false,
        of_numbers: false,
    },
    Form {
        text: "*sin({})",
        value: |x, _| x.sin(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "*cos({})",
        value: |x, _| x.cos(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "*log({})",
        value: |x, _| x.ln(),
        inner: &[],
        power: (0, 1),
        domain: Domain::Positive,
        complexity: 2,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "*exp(-{})",
        value: |x, _| (-x).exp(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "*exp({})",
        value: |x, _| x.exp(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "/tan({})",
        value: |x, _| x.tan().recip(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "*tan({})",
        value: |x, _| x.tan(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "*sin({})^2",
        value: |x, _| x.sin() * x.sin(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: true,
        of_numbers: true,
    },
    Form {
        text: "*cos({})^2",
        value: |x, _| x.cos() * x.cos(),
        inner: &[],
        power: (0, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: true,
        of_numbers: true,
    },
];

/// Inner constants relative to the size of a quantity: a bend in the first hundredth of the range is a step, and one at
/// three times the range is a straight line.
const PARTS: &[f64] = &[0.03, 0.1, 0.3, 1.0, 3.0];

/// Position of the form with this text.
#[cfg(test)]
pub(crate) fn position(text: &str) -> usize {
    FORMS.iter().position(|form| form.text == text).expect("a form")
}

#[cfg(test)]
mod tests {
    use super::{Domain, FORMS};

    #[test]
    fn values_go_with_the_power_of_their_unit() {
        for form in FORMS.iter().filter(|form| !form.of_numbers) {
            for x in [0.7, -0.7] {
                if form.domain == Domain::Positive && x < 0.0 {
                    continue;
                }
                let (n, d) = form.power;
                let expected = (form.value)(x, 0.4) * 3_f64.powf(n as f64 / d as f64);
                let found = (form.value)(3.0 * x, 1.2);
                assert!((found - expected).abs() < 1e-12, "{}: {found}", form.text);
            }
        }
    }

    #[test]
    fn a_quantity_that_comes_close_to_zero_divides_nothing() {
        assert!(Domain::OneSign.holds([-1.0, -3.0].into_iter()));
        assert!(!Domain::OneSign.holds([-0.1, -3.0].into_iter()));
        assert!(!Domain::OneSign.holds([1.0, -3.0].into_iter()));
        assert!(!Domain::Positive.holds([-1.0, -3.0].into_iter()));
    }
}
