//! The table of functions that a formula may apply to a name of a model.

/// A function of one quantity, as a factor after a coefficient.
#[derive(Debug)]
pub(crate) struct FactorForm {
    /// The factor in the language, with `{}` for the name and `{b}` for the inner constant.
    pub text: &'static str,
    /// Its value for a quantity and an inner constant, SI.
    pub value: fn(f64, f64) -> f64,
    /// The inner constant, which has the unit of the quantity.
    pub inner: FormConstant,
    /// Exponent of the quantity's unit in the factor: numerator and denominator.
    pub power: (i64, i64),
    /// Values for which it is defined.
    pub domain: FormDomain,
    /// Complexity for a reader.
    pub complexity: u32,
    /// Whether it is tried in products of two.
    pub in_products: bool,
    /// Whether its quantity has to be dimensionless.
    pub of_numbers: bool,
}

impl FactorForm {
    /// Whether it divides by the quantity.
    pub(crate) fn divides(&self) -> bool {
        self.power.0 < 0 || self.text.starts_with('/')
    }
}

/// The inner constant of a [`FactorForm`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FormConstant {
    /// There is none.
    None,
    /// A size at which the form bends.
    Parts,
    /// A value at which a regime begins or ends.
    Thresholds,
}

/// Sizes to try, relative to that of the quantity (its largest value): a bend in the first hundredth of the range is a
/// step, and one at three times the range is a straight line.
const PARTS: &[f64] = &[0.03, 0.1, 0.3, 1.0, 3.0];
/// Number of equally filled parts of the values, between which thresholds are tried.
const QUANTILES: usize = 20;

impl FormConstant {
    /// Constants to try for values of the quantity.
    pub(crate) fn constants(self, values: &[f64]) -> Vec<f64> {
        let finite = values.iter().copied().filter(|x| x.is_finite());
        match self {
            FormConstant::None => Vec::new(),
            FormConstant::Parts => {
                let size = finite.fold(0.0, |size: f64, x| size.max(x.abs()));
                PARTS.iter().map(|part| part * size).filter(|constant| *constant > 0.0).collect()
            }
            FormConstant::Thresholds => {
                let mut sorted: Vec<f64> = finite.collect();
                sorted.sort_by(f64::total_cmp);
                let last = sorted.len().saturating_sub(1) as f64;
                let quantile =
                    |k: usize| sorted.get((last * k as f64 / QUANTILES as f64).round() as usize);
                let mut thresholds: Vec<f64> =
                    (1..QUANTILES).filter_map(quantile).copied().collect();
                thresholds.dedup();
                thresholds
            }
        }
    }
}

/// Values for which a [`FactorForm`] is defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FormDomain {
    /// Any values.
    All,
    /// Positive values, not close to zero.
    Positive,
    /// Values of one sign, not close to zero.
    OneSign,
}

/// Minimum distance from zero, as a fraction of the largest value, for forms that need one.
const CLOSE: f64 = 0.05;

impl FormDomain {
    /// Whether all values lie in it.
    pub(crate) fn holds(self, values: impl Iterator<Item = f64>) -> bool {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in values.filter(|x| x.is_finite()) {
            (least, most) = (least.min(x), most.max(x));
        }
        let is_positive = least > CLOSE * most.abs();
        match self {
            FormDomain::All => true,
            FormDomain::Positive => is_positive,
            FormDomain::OneSign => is_positive || -most > CLOSE * least.abs(),
        }
    }
}

/// The plainest form, which supplies the defaults of the others.
const PLAIN: FactorForm = FactorForm {
    text: "*{}",
    value: |x, _| x,
    inner: FormConstant::None,
    power: (1, 1),
    domain: FormDomain::All,
    complexity: 1,
    in_products: false,
    of_numbers: false,
};

/// All forms; of equivalent ones, such as x² and x|x| for positive x, the first is used.
pub(crate) static FORMS: [FactorForm; 35] = [
    FactorForm { text: "*{}", value: |x, _| x, in_products: true, ..PLAIN },
    FactorForm {
        text: "*{}^2",
        value: |x, _| x * x,
        power: (2, 1),
        complexity: 2,
        in_products: true,
        ..PLAIN
    },
    FactorForm {
        text: "*{}*abs({})",
        value: |x, _| x * x.abs(),
        power: (2, 1),
        complexity: 2,
        in_products: true,
        ..PLAIN
    },
    FactorForm {
        text: "*sqrt({})",
        value: |x, _| x.sqrt(),
        power: (1, 2),
        domain: FormDomain::Positive,
        complexity: 2,
        in_products: true,
        ..PLAIN
    },
    FactorForm {
        text: "/{}",
        value: |x, _| x.recip(),
        power: (-1, 1),
        domain: FormDomain::OneSign,
        complexity: 2,
        in_products: true,
        ..PLAIN
    },
    FactorForm { text: "*abs({})", value: |x, _| x.abs(), complexity: 2, ..PLAIN },
    FactorForm { text: "*max({}, 0)", value: |x, _| x.max(0.0), complexity: 2, ..PLAIN },
    FactorForm { text: "*min({}, 0)", value: |x, _| x.min(0.0), complexity: 2, ..PLAIN },
    FactorForm {
        text: "*sign({})*sqrt(abs({}))",
        value: |x, _| x.signum() * x.abs().sqrt(),
        power: (1, 2),
        complexity: 3,
        ..PLAIN
    },
    FactorForm {
        text: "/{}^2",
        value: |x, _| (x * x).recip(),
        power: (-2, 1),
        domain: FormDomain::OneSign,
        complexity: 3,
        ..PLAIN
    },
    FactorForm {
        text: "/sqrt({})",
        value: |x, _| x.sqrt().recip(),
        power: (-1, 2),
        domain: FormDomain::Positive,
        complexity: 3,
        ..PLAIN
    },
    FactorForm { text: "*{}^3", value: |x, _| x * x * x, power: (3, 1), complexity: 3, ..PLAIN },
    FactorForm {
        text: "*{}*sqrt(abs({}))",
        value: |x, _| x * x.abs().sqrt(),
        power: (3, 2),
        complexity: 3,
        ..PLAIN
    },
    FactorForm {
        text: "*{}^(1/3)",
        value: |x, _| x.cbrt(),
        power: (1, 3),
        domain: FormDomain::Positive,
        complexity: 3,
        ..PLAIN
    },
    FactorForm {
        text: "*{}^(2/3)",
        value: |x, _| x.cbrt() * x.cbrt(),
        power: (2, 3),
        domain: FormDomain::Positive,
        complexity: 3,
        ..PLAIN
    },
    FactorForm {
        text: "/{}^(3/2)",
        value: |x, _| (x * x.sqrt()).recip(),
        power: (-3, 2),
        domain: FormDomain::Positive,
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "*{}/({b} + abs({}))",
        value: |x, b| x / (b + x.abs()),
        inner: FormConstant::Parts,
        power: (0, 1),
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "/({b} + abs({}))",
        value: |x, b| (b + x.abs()).recip(),
        inner: FormConstant::Parts,
        power: (-1, 1),
        complexity: 5,
        ..PLAIN
    },
    FactorForm {
        text: "*tanh({}/{b})",
        value: |x, b| (x / b).tanh(),
        inner: FormConstant::Parts,
        power: (0, 1),
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "*exp({}/{b})",
        value: |x, b| (x / b).exp(),
        inner: FormConstant::Parts,
        power: (0, 1),
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "*exp(-{}/{b})",
        value: |x, b| (-x / b).exp(),
        inner: FormConstant::Parts,
        power: (0, 1),
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "*{}^2/({b}^2 + {}^2)",
        value: |x, b| x * x / (b * b + x * x),
        inner: FormConstant::Parts,
        power: (0, 1),
        complexity: 5,
        ..PLAIN
    },
    FactorForm {
        text: "*sin({})",
        value: |x, _| x.sin(),
        power: (0, 1),
        complexity: 2,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*cos({})",
        value: |x, _| x.cos(),
        power: (0, 1),
        complexity: 2,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*log({})",
        value: |x, _| x.ln(),
        power: (0, 1),
        domain: FormDomain::Positive,
        complexity: 2,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*exp(-{})",
        value: |x, _| (-x).exp(),
        power: (0, 1),
        complexity: 3,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*exp({})",
        value: |x, _| x.exp(),
        power: (0, 1),
        complexity: 3,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "/tan({})",
        value: |x, _| x.tan().recip(),
        power: (0, 1),
        complexity: 3,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*tan({})",
        value: |x, _| x.tan(),
        power: (0, 1),
        complexity: 3,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*sin({})^2",
        value: |x, _| x.sin() * x.sin(),
        power: (0, 1),
        complexity: 3,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*cos({})^2",
        value: |x, _| x.cos() * x.cos(),
        power: (0, 1),
        complexity: 3,
        in_products: true,
        of_numbers: true,
        ..PLAIN
    },
    FactorForm {
        text: "*max({} - {b}, 0)",
        value: |x, b| (x - b).max(0.0),
        inner: FormConstant::Thresholds,
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "*min({} - {b}, 0)",
        value: |x, b| (x - b).min(0.0),
        inner: FormConstant::Thresholds,
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "*(if {} > {b} then 1 else 0)",
        value: |x, b| f64::from(x > b),
        inner: FormConstant::Thresholds,
        power: (0, 1),
        complexity: 4,
        ..PLAIN
    },
    FactorForm {
        text: "*(if {} < {b} then 1 else 0)",
        value: |x, b| f64::from(x < b),
        inner: FormConstant::Thresholds,
        power: (0, 1),
        complexity: 4,
        ..PLAIN
    },
];

/// Position of the form with this text.
#[cfg(test)]
pub(crate) fn position(text: &str) -> usize {
    FORMS.iter().position(|form| form.text == text).expect("a form")
}

#[cfg(test)]
mod tests {
    use super::{FORMS, FormDomain};

    #[test]
    fn values_go_with_the_power_of_their_unit() {
        for form in FORMS.iter().filter(|form| !form.of_numbers) {
            for x in [0.7, -0.7] {
                if form.domain == FormDomain::Positive && x < 0.0 {
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
        assert!(FormDomain::OneSign.holds([-1.0, -3.0].into_iter()));
        assert!(!FormDomain::OneSign.holds([-0.1, -3.0].into_iter()));
        assert!(!FormDomain::OneSign.holds([1.0, -3.0].into_iter()));
        assert!(!FormDomain::Positive.holds([-1.0, -3.0].into_iter()));
    }
}
