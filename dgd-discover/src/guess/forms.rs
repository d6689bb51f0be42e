//! What a formula may make of one name of a model: one row for each.

/// A function of one quantity, as a factor behind a coefficient.
#[derive(Debug)]
pub(crate) struct Form {
    /// The factor in the language, `{}` in the place of the name.
    pub text: &'static str,
    /// Its value, SI.
    pub value: fn(f64) -> f64,
    /// Power of the quantity's unit that it has: numerator and denominator.
    pub power: (i64, i64),
    /// What it is defined for.
    pub domain: Domain,
    /// How much a reader has to take in.
    pub complexity: u32,
    /// Whether it is tried in products of two.
    pub in_products: bool,
}

/// Values that a [`Form`] takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    /// Any.
    All,
    /// Positive ones, not close to zero.
    Positive,
    /// Those of one sign, not close to zero.
    OneSign,
}

/// Share of its largest value that a quantity keeps from zero where it must.
const CLOSE: f64 = 0.05;

impl Domain {
    /// Whether a quantity keeps to it.
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

/// All forms; of those that come to the same, as x² and x|x| of a positive x, the first is written.
pub(crate) static FORMS: [Form; 16] = [
    Form {
        text: "*{}",
        value: |x| x,
        power: (1, 1),
        domain: Domain::All,
        complexity: 1,
        in_products: true,
    },
    Form {
        text: "*{}^2",
        value: |x| x * x,
        power: (2, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: true,
    },
    Form {
        text: "*{}*abs({})",
        value: |x| x * x.abs(),
        power: (2, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: true,
    },
    Form {
        text: "*sqrt({})",
        value: f64::sqrt,
        power: (1, 2),
        domain: Domain::Positive,
        complexity: 2,
        in_products: true,
    },
    Form {
        text: "/{}",
        value: f64::recip,
        power: (-1, 1),
        domain: Domain::OneSign,
        complexity: 2,
        in_products: true,
    },
    Form {
        text: "*abs({})",
        value: f64::abs,
        power: (1, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: false,
    },
    Form {
        text: "*max({}, 0)",
        value: |x| x.max(0.0),
        power: (1, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: false,
    },
    Form {
        text: "*min({}, 0)",
        value: |x| x.min(0.0),
        power: (1, 1),
        domain: Domain::All,
        complexity: 2,
        in_products: false,
    },
    Form {
        text: "*sign({})*sqrt(abs({}))",
        value: |x| x.signum() * x.abs().sqrt(),
        power: (1, 2),
        domain: Domain::All,
        complexity: 3,
        in_products: false,
    },
    Form {
        text: "/{}^2",
        value: |x| (x * x).recip(),
        power: (-2, 1),
        domain: Domain::OneSign,
        complexity: 3,
        in_products: false,
    },
    Form {
        text: "/sqrt({})",
        value: |x| x.sqrt().recip(),
        power: (-1, 2),
        domain: Domain::Positive,
        complexity: 3,
        in_products: false,
    },
    Form {
        text: "*{}^3",
        value: |x| x * x * x,
        power: (3, 1),
        domain: Domain::All,
        complexity: 3,
        in_products: false,
    },
    Form {
        text: "*{}*sqrt(abs({}))",
        value: |x| x * x.abs().sqrt(),
        power: (3, 2),
        domain: Domain::All,
        complexity: 3,
        in_products: false,
    },
    Form {
        text: "*{}^(1/3)",
        value: f64::cbrt,
        power: (1, 3),
        domain: Domain::Positive,
        complexity: 3,
        in_products: false,
    },
    Form {
        text: "*{}^(2/3)",
        value: |x| x.cbrt() * x.cbrt(),
        power: (2, 3),
        domain: Domain::Positive,
        complexity: 3,
        in_products: false,
    },
    Form {
        text: "/{}^(3/2)",
        value: |x| (x * x.sqrt()).recip(),
        power: (-3, 2),
        domain: Domain::Positive,
        complexity: 4,
        in_products: false,
    },
];

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
        for form in &FORMS {
            for x in [0.7, -0.7] {
                if form.domain == Domain::Positive && x < 0.0 {
                    continue;
                }
                let (n, d) = form.power;
                let expected = (form.value)(x) * 3_f64.powf(n as f64 / d as f64);
                let found = (form.value)(3.0 * x);
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
