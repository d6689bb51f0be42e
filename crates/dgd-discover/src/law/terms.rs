//! Candidate terms: products of functions of the model's names.

use dgd_compiler::units::Dimension;

use crate::guess::{FORMS, FactorForm, FormConstant, FormulaFactor, FormulaShape};

/// Number of names in products; the best by themselves if there are more.
pub(super) const IN_PRODUCTS: usize = 6;
/// Number of differences in products, chosen in the same way.
pub(super) const DIFFERENCES: usize = 3;

/// The inner constants that terms may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TermVocabulary {
    /// Sizes at which they bend.
    Smooth,
    /// Thresholds at which a regime begins or ends, and differences of names.
    Regimes,
}

impl TermVocabulary {
    /// Whether terms read a name. A difference is a sum of two smooth terms, so smooth ones do without.
    pub(super) fn reads(self, name: &FormulaFactor) -> bool {
        self == TermVocabulary::Regimes || name.difference.is_none()
    }

    fn has(self, form: &FactorForm) -> bool {
        match form.inner {
            FormConstant::None => true,
            FormConstant::Parts => self == TermVocabulary::Smooth,
            FormConstant::Thresholds => self == TermVocabulary::Regimes,
        }
    }
}

/// Shapes of one name, and the constant.
pub(super) fn single(
    names: &[FormulaFactor],
    values: &[Vec<f64>],
    vocabulary: TermVocabulary,
) -> Vec<FormulaShape> {
    let mut shapes = vec![FormulaShape::new(Vec::new())];
    for name in (0..names.len()).filter(|name| vocabulary.reads(&names[*name])) {
        for (i, form) in FORMS.iter().enumerate().filter(|(_, form)| vocabulary.has(form)) {
            if form.inner == FormConstant::None {
                shapes.push(FormulaShape::new(vec![(name, i)]));
            }
            let with = |inner: f64| FormulaShape {
                inner: Some(inner),
                ..FormulaShape::new(vec![(name, i)])
            };
            shapes.extend(form.inner.constants(&values[name]).into_iter().map(with));
        }
    }
    shapes.retain(|shape| is_defined(shape, names, values));
    shapes
}

/// Products of functions of some names.
pub(super) fn products(
    names: &[FormulaFactor],
    values: &[Vec<f64>],
    chosen: &[usize],
    vocabulary: TermVocabulary,
) -> Vec<FormulaShape> {
    let forms_with = |is: fn(&FactorForm) -> bool| -> Vec<usize> {
        (0..FORMS.len()).filter(|form| is(&FORMS[*form])).collect()
    };
    let plain = forms_with(|form| form.in_products);
    let mut inner = forms_with(|form| form.inner != FormConstant::None);
    inner.retain(|form| vocabulary.has(&FORMS[*form]));
    let powers = forms_with(|form| form.in_products && !form.of_numbers && form.power.0 > 0);
    let numbers = forms_with(|form| form.in_products && form.of_numbers);
    let mut factor_lists: Vec<Vec<(usize, usize)>> = Vec::new();
    for (i, &a) in chosen.iter().enumerate() {
        // Products of one name: a power times a function of numbers, or two such functions.
        for (k, &f) in numbers.iter().enumerate() {
            factor_lists.extend(powers.iter().map(|g| vec![(a, *g), (a, f)]));
            factor_lists.extend(numbers[..k].iter().map(|g| vec![(a, *g), (a, f)]));
        }
        for (j, &b) in chosen.iter().enumerate().skip(i + 1) {
            for &f in &plain {
                factor_lists.extend(plain.iter().map(|g| vec![(a, f), (b, *g)]));
            }
            for &c in &chosen[j + 1..] {
                for &f in &powers {
                    for &g in &powers {
                        let three = powers.iter().map(|h| vec![(a, f), (b, g), (c, *h)]);
                        let complexity = |factors: &Vec<(usize, usize)>| -> u32 {
                            factors.iter().map(|(_, form)| FORMS[*form].complexity).sum()
                        };
                        factor_lists
                            .extend(three.filter(|factors| complexity(factors) <= MOST_OF_THREE));
                    }
                }
            }
        }
    }
    let shapes = factor_lists.into_iter().map(|factors| FormulaShape::new(factors).in_order());
    let mut shapes: Vec<FormulaShape> = shapes.collect();
    // In a product with a threshold, the other factor is the quantity that the regime switches on; the first form is the
    // quantity itself.
    let beside: &[usize] = match vocabulary {
        TermVocabulary::Smooth => &powers,
        TermVocabulary::Regimes => &plain[..1],
    };
    for &a in chosen {
        for &form in &inner {
            for constant in FORMS[form].inner.constants(&values[a]) {
                for &b in chosen {
                    for &g in beside {
                        let factors = vec![(a, form), (b, g)];
                        shapes.push(FormulaShape {
                            inner: Some(constant),
                            ..FormulaShape::new(factors)
                        });
                    }
                }
            }
        }
    }
    shapes.retain(|shape| shape.complexity() <= MOST_COMPLEX && is_defined(shape, names, values));
    shapes
}

/// Largest complexity of a product.
const MOST_COMPLEX: u32 = 7;
/// Largest complexity of a product of three names.
const MOST_OF_THREE: u32 = 4;

/// Whether the names have values and units for all its forms.
pub(super) fn is_defined(
    shape: &FormulaShape,
    names: &[FormulaFactor],
    values: &[Vec<f64>],
) -> bool {
    shape.forms().all(|(name, form)| {
        let is_number =
            names[name].unit.dimension == Dimension::ONE && names[name].unit.factor == 1.0;
        (is_number || !form.of_numbers) && form.domain.holds(values[name].iter().copied())
    })
}

#[cfg(test)]
mod tests {
    use dgd_compiler::units::parse_unit;

    use super::*;

    fn names() -> Vec<FormulaFactor> {
        let factor = |name: &str, unit: &str| FormulaFactor {
            name: name.to_owned(),
            unit: parse_unit(unit).expect("a unit"),
            difference: None,
        };
        vec![factor("q", "lpm"), factor("a", "1"), factor("h", "m")]
    }

    fn values() -> Vec<Vec<f64>> {
        let along = |f: fn(f64) -> f64| (0..50).map(|k| f(f64::from(k) / 10.0)).collect();
        vec![along(|t| 1.0 + t), along(|t| (2.0 * t).sin()), along(|t| 2.0 + t.cos())]
    }

    fn texts(shapes: &[FormulaShape]) -> Vec<String> {
        shapes.iter().map(|shape| shape.text(&names())).collect()
    }

    #[test]
    fn only_numbers_have_sines() {
        let single = texts(&single(&names(), &values(), TermVocabulary::Smooth));
        assert!(single.contains(&" * sin(a)".to_owned()));
        assert!(!single.iter().any(|text| text.contains("sin(q)") || text.contains("exp(q)")));
        // A quantity has one of its ratio to a constant.
        assert!(single.iter().any(|text| text.starts_with(" * exp(q/")));
    }

    #[test]
    fn nothing_divides_by_what_passes_zero() {
        let mut all = single(&names(), &values(), TermVocabulary::Smooth);
        all.extend(products(&names(), &values(), &[0, 1, 2], TermVocabulary::Smooth));
        let texts = texts(&all);
        assert!(texts.contains(&" * q/h".to_owned()), "{texts:?}");
        assert!(!texts.iter().any(|text| text.contains("/a") || text.contains("sqrt(a)")));
    }

    #[test]
    fn products_have_up_to_three_names() {
        let texts = texts(&products(&names(), &values(), &[0, 1, 2], TermVocabulary::Smooth));
        for expected in [" * q*a", " * q*a*h", " * a*sin(a)", " * sin(a)*cos(a)", " * q*a^2*h"] {
            assert!(texts.contains(&expected.to_owned()), "{expected}: {texts:?}");
        }
        assert!(texts.iter().any(|text| text.starts_with(" * q/(") && text.ends_with("*a")));
    }
}
