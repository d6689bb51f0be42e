//! Finds the formulas of a model's names that best resemble a missing input.
//!
//! The smoothed estimate d of the missing term is correlated over the time that it resolves, so means over blocks of
//! that length are used instead of samples. In addition to the formula, the parameters of the equation are free: the
//! contribution of their errors to d,
//!
//! ```text
//!   d ≈ Σ cᵢ φᵢ(names) + Σ bⱼ pⱼ (∂f/∂pⱼ)/(∂f/∂d),     bⱼ ~ N(0, 0.3²)
//! ```
//!
//! is not part of a formula, and the base model's fit removed it from d. Coefficients are least-squares estimates, with
//! each block weighted by 1/(std² + (d_rms/20)²).
//!
//! Formulas of one term, then of two, are ranked by their residuals in tenths of the training recordings to which they
//! were not fitted, with a penalty for complexity:
//!
//! ```text
//!   ln(1 − R²) + complexity/20 + 0.7 for a second term
//! ```
//!
//! The best formula may depend on a few of these tenths. So tenths are resampled with replacement many times (Fasel,
//! Kutz, Brunton & Brunton 2022, "Ensemble-SINDy"): each drawing ranks the best formulas by their residuals in the
//! tenths that were not drawn. Formulas that come first in at least a tenth of the drawings are also returned, the most
//! frequent first.
//!
//! Inner constants, such as that of a tanh, come from a short grid relative to the size of their quantity; a fit
//! refines them.
//!
//! Unknowns respond to the missing term, so a formula of unknowns can resemble it for that reason alone. Inputs do not
//! respond. So the best formulas of inputs alone are returned alongside the best of all; this regression cannot decide
//! between them.
//!
//! R² is 1 − Σ w (d − formula)²/Σ w (d − d₀)², where d₀ is the best constant with free parameters of the equation.

use nalgebra::DMatrix;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::forms::{FORMS, FormConstant};
use super::formula::FormulaShape;
use super::moments::{BlockMoments, FOLDS, InputTrace};

/// A formula with its coefficients.
#[derive(Debug, Clone)]
pub(crate) struct RankedFormula {
    /// Shapes and their coefficients, SI.
    pub terms: Vec<(FormulaShape, f64)>,
    /// R² in validation recordings or, if there are none, in blocks left out.
    pub r2: f64,
    /// Penalty for complexity and number of terms: the decrease of the logarithm of the mean square error that
    /// justifies them.
    pub cost: f64,
}

/// Penalty for complexity, and for a second term.
const COMPLEXITY: f64 = 0.05;
const SECOND_TERM: f64 = 0.7;
/// Minimum R² of a formula or a curve on data to which it was not fitted.
pub(super) const DECENT: f64 = 0.5;
/// Number of formulas of each kind that are examined, and that are returned.
const LOOKED_AT: usize = 20;
const TOLD: usize = 5;
/// Differences of 1 − R² below this are meaningless.
const UNRESOLVED: f64 = 1e-4;
/// Number of names used in products, the best by themselves; and of first terms that get a second one.
const IN_PRODUCTS: usize = 8;
const FIRST_TERMS: usize = 40;
/// Number of drawings of parts; number of the best formulas of one term, and of two, that they rank; and how often a
/// formula must come first to be returned.
const DRAWINGS: usize = 50;
const DRAWN_FROM: usize = 30;
const FREQUENT: usize = 5;

/// Ranks a formula that was found elsewhere.
pub(crate) fn given(
    train: &[InputTrace],
    held_out: &[InputTrace],
    terms: &[(FormulaShape, f64)],
) -> RankedFormula {
    let shapes: Vec<FormulaShape> = terms.iter().map(|(shape, _)| shape.clone()).collect();
    let indices: Vec<usize> = (0..shapes.len()).collect();
    let held_out_fit = BlockMoments::new(train, held_out, shapes).held_out(&indices);
    RankedFormula {
        terms: terms.to_vec(),
        r2: held_out_fit.map_or(f64::NAN, |(_, r2)| r2),
        cost: 0.0,
    }
}

/// Formulas of at most two terms: the best of all names, then the best of inputs alone.
///
/// | name | shape |
/// |---|---|
/// | `names` | number of inputs, which come first, and of all names |
/// | `is_preferred` | whether a shape's coefficient would be dimensionless or have a parameter's dimension |
pub(crate) fn ranked(
    train: &[InputTrace],
    held_out: &[InputTrace],
    [inputs, names]: [usize; 2],
    is_preferred: &dyn Fn(&FormulaShape) -> bool,
) -> Vec<RankedFormula> {
    let traces: Vec<&InputTrace> = train.iter().chain(held_out).collect();
    let is_defined = |shape: &FormulaShape| {
        shape.forms().all(|(name, form)| {
            let mut of_traces = traces.iter().map(|trace| trace.names[name].iter().copied());
            of_traces.all(|values| form.domain.holds(values))
        })
    };
    let cost = |shape: &FormulaShape| {
        let complexity = shape.complexity() + u32::from(!is_preferred(shape));
        COMPLEXITY * f64::from(complexity)
    };
    let one = |name: usize, form: usize| FormulaShape::new(vec![(name, form)]);
    let plain = (0..FORMS.len())
        .filter(|form| FORMS[*form].inner == FormConstant::None && !FORMS[*form].of_numbers);
    let plain: Vec<usize> = plain.collect();
    let mut shapes = vec![FormulaShape::new(Vec::new())];
    shapes.extend((0..names).flat_map(|name| plain.iter().map(move |form| one(name, *form))));
    shapes.retain(is_defined);

    // Ranks names by how well they do alone, for inner constants and products of the best.
    let singles = BlockMoments::new(train, held_out, shapes.clone());
    let mut by_name: Vec<(f64, usize)> = (0..names)
        .filter_map(|name| {
            let with_name =
                (0..shapes.len()).filter(|i| shapes[*i].factors.iter().any(|f| f.0 == name));
            let left = with_name.filter_map(|i| singles.left_out(&[i])).min_by(f64::total_cmp)?;
            Some((left, name))
        })
        .collect();
    by_name.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Vec<usize> = by_name.iter().take(IN_PRODUCTS).map(|(_, name)| *name).collect();
    best.sort_unstable();
    for &name in &best {
        let values: Vec<f64> =
            train.iter().flat_map(|trace| trace.names[name].iter().copied()).collect();
        let parts = FormConstant::Parts.constants(&values);
        for form in (0..FORMS.len()).filter(|form| FORMS[*form].inner == FormConstant::Parts) {
            let with = |constant: &f64| FormulaShape { inner: Some(*constant), ..one(name, form) };
            shapes.extend(parts.iter().map(with));
        }
    }
    let in_products =
        (0..FORMS.len()).filter(|form| FORMS[*form].in_products && !FORMS[*form].of_numbers);
    let in_products: Vec<usize> = in_products.collect();
    for (i, a) in best.iter().enumerate() {
        for b in &best[i + 1..] {
            for (fa, fb) in
                in_products.iter().flat_map(|fa| in_products.iter().map(move |fb| (fa, fb)))
            {
                // A quotient is written with its divisor last.
                let factors = if FORMS[*fa].power.0 < 0 {
                    vec![(*b, *fb), (*a, *fa)]
                } else {
                    vec![(*a, *fa), (*b, *fb)]
                };
                shapes.push(FormulaShape::new(factors));
            }
        }
    }
    shapes.retain(is_defined);
    shapes.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    let moments = BlockMoments::new(train, held_out, shapes).without_twins();

    let cost = |chosen: &[usize]| {
        let of_shapes: f64 = chosen.iter().map(|i| cost(&moments.shapes[*i])).sum();
        of_shapes + SECOND_TERM * (chosen.len() - 1) as f64
    };
    let price = |left: f64, chosen: &[usize]| left.max(UNRESOLVED).ln() + cost(chosen);
    let score = |chosen: &[usize]| Some(price(moments.left_out(chosen)?, chosen));
    let mut scored: Vec<(f64, Vec<usize>)> =
        (0..moments.shapes.len()).filter_map(|i| Some((score(&[i])?, vec![i]))).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let first: Vec<usize> = scored.iter().take(FIRST_TERMS).map(|(_, one)| one[0]).collect();
    for (k, &i) in first.iter().enumerate() {
        for j in (0..moments.shapes.len()).filter(|j| *j != i && !first[..k].contains(j)) {
            scored.extend(score(&[i, j]).map(|score| (score, vec![i, j])));
        }
    }
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_of_inputs = |chosen: &Vec<usize>| {
        chosen.iter().all(|i| moments.shapes[*i].factors.iter().all(|(name, _)| *name < inputs))
    };
    let to_ranked = |chosen: &Vec<usize>| {
        let (coefficients, r2) = moments.held_out(chosen)?;
        let shapes = chosen.iter().map(|i| moments.shapes[*i].clone());
        let terms = shapes.zip(coefficients).collect();
        let ranked = RankedFormula { terms, r2, cost: cost(chosen) };
        (r2 >= DECENT).then_some(ranked)
    };
    let sets = scored.iter().map(|(_, chosen)| chosen);
    let best = sets.clone().take(LOOKED_AT).filter_map(to_ranked).take(TOLD);
    let drawn = first_in_drawings(&moments, &scored, &price);
    let drawn = drawn.iter().filter_map(to_ranked).take(TOLD);
    let of_inputs = sets.filter(|chosen| is_of_inputs(chosen)).take(LOOKED_AT);
    let of_inputs = of_inputs.filter_map(to_ranked).take(TOLD);
    let mut formulas: Vec<RankedFormula> = best.chain(drawn).chain(of_inputs).collect();
    let mut earlier: Vec<Vec<FormulaShape>> = Vec::new();
    formulas.retain(|ranked| {
        let shapes: Vec<FormulaShape> =
            ranked.terms.iter().map(|(shape, _)| shape.clone()).collect();
        let is_new = !earlier.contains(&shapes);
        earlier.push(shapes);
        is_new
    });
    formulas
}

/// The best formulas that often come first when parts of the training recordings are resampled, the most frequent
/// first.
fn first_in_drawings(
    moments: &BlockMoments,
    scored: &[(f64, Vec<usize>)],
    price: &dyn Fn(f64, &[usize]) -> f64,
) -> Vec<Vec<usize>> {
    // Separately for each number of terms: a second term that hardly matters turns one formula into many.
    let of_terms = |terms: usize| {
        scored.iter().filter(move |(_, chosen)| chosen.len() == terms).take(DRAWN_FROM)
    };
    let best: Vec<&(f64, Vec<usize>)> = of_terms(1).chain(of_terms(2)).collect();
    let mut shapes: Vec<usize> = best.iter().flat_map(|(_, chosen)| chosen).copied().collect();
    shapes.sort_unstable();
    shapes.dedup();
    let of_best = moments.select(&shapes);
    let positions = |(_, chosen): &&(f64, Vec<usize>)| -> Vec<usize> {
        chosen.iter().filter_map(|i| shapes.binary_search(i).ok()).collect()
    };
    let columns: Vec<Vec<usize>> = best.iter().map(positions).collect();
    let size = of_best.train.nrows();
    let mut random = Pcg64::new(0, 0);
    let mut first = vec![0; best.len()];
    for _ in 0..DRAWINGS {
        let mut times = [0_u32; FOLDS];
        for _ in 0..FOLDS {
            times[(random.next_u64() % FOLDS as u64) as usize] += 1;
        }
        let (mut drawn, mut undrawn) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
        for (part, times) in of_best.parts.iter().zip(times) {
            if times > 0 {
                drawn += part * f64::from(times);
            } else {
                undrawn += part;
            }
        }
        let Some(all) = of_best.around_a_constant(&undrawn) else { continue };
        let prices =
            best.iter().zip(&columns).enumerate().filter_map(|(k, ((_, chosen), columns))| {
                let left = of_best.square_of(&undrawn, &drawn, columns)? / all;
                Some((price(left, chosen), k))
            });
        if let Some((_, k)) = prices.min_by(|a, b| a.0.total_cmp(&b.0)) {
            first[k] += 1;
        }
    }
    let mut frequent: Vec<usize> = (0..best.len()).filter(|k| first[*k] >= FREQUENT).collect();
    frequent.sort_by_key(|k| std::cmp::Reverse(first[*k]));
    frequent.into_iter().map(|k| best[k].1.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::{FOLDS, RankedFormula, ranked};
    use crate::guess::forms::position;
    use crate::guess::moments::InputTrace;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    const SAMPLES: usize = 900;

    /// The missing term as a function of the names.
    type Missing = fn(&[f64]) -> f64;

    /// Steps of random height every `length` samples.
    fn steps(random: &mut Pcg64, length: usize, low: f64, high: f64) -> Vec<f64> {
        let mut level = low;
        let mut next = |k: usize| {
            if k.is_multiple_of(length) {
                let unit = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
                level = low + (high - low) * unit;
            }
            level
        };
        (0..SAMPLES).map(&mut next).collect()
    }

    /// Noise after a smoother: a mean over 20 samples.
    fn noise(random: &mut Pcg64, size: f64) -> Vec<f64> {
        let raw = steps(random, 1, -1.0, 1.0);
        let mean = |k: usize| {
            let those = &raw[k.saturating_sub(10)..(k + 10).min(SAMPLES)];
            those.iter().sum::<f64>() / those.len() as f64
        };
        // The variance of a uniform distribution in ±1 is a third.
        (0..SAMPLES).map(|k| size * mean(k) * 60_f64.sqrt()).collect()
    }

    fn trace(seed: u64, d: impl Fn(&[f64]) -> f64, size: f64) -> InputTrace {
        let mut random = Pcg64::new(u128::from(seed), 3);
        let names = vec![
            steps(&mut random, 45, 0.2, 1.5),
            steps(&mut random, 70, -2.0, 3.0),
            steps(&mut random, 30, 1.0, 4.0),
        ];
        let errors = noise(&mut random, size);
        let value = (0..SAMPLES).map(|k| {
            let at: Vec<f64> = names.iter().map(|values| values[k]).collect();
            d(&at) + errors[k]
        });
        InputTrace {
            times: (0..SAMPLES).map(|k| k as f64).collect(),
            value: value.collect(),
            std: vec![size; SAMPLES],
            resolved: 20.0,
            // The equation has a parameter that multiplies the second name.
            parameters: vec![names[1].clone()],
            names,
        }
    }

    fn rank(seed: u64, d: impl Fn(&[f64]) -> f64 + Copy, size: f64) -> Vec<RankedFormula> {
        ranked(&[trace(seed, d, size)], &[trace(seed + 1000, d, size)], [1, 3], &|_| true)
    }

    #[test]
    fn the_form_is_found_beside_what_a_parameter_takes_over() {
        let forms: [(Missing, &str, f64); 4] = [
            (|x| 0.7 * x[0] * x[2].sqrt() + 0.1 * x[1], "1*sqrt", 0.7),
            (|x| -1.3 * x[1] * x[1].abs() + 0.4 * x[1], "x|x|", -1.3),
            (|x| 2.0 * x[0] / x[2], "quotient", 2.0),
            (|x| 0.5 * x[2] * x[2], "square", 0.5),
        ];
        let expected: [&[(usize, &str)]; 4] = [
            &[(0, "*{}"), (2, "*sqrt({})")],
            &[(1, "*{}*abs({})")],
            &[(0, "*{}"), (2, "/{}")],
            &[(2, "*{}^2")],
        ];
        for ((d, name, size), factors) in forms.into_iter().zip(expected) {
            let factors: Vec<_> = factors.iter().map(|(i, form)| (*i, position(form))).collect();
            for seed in 0..5 {
                let all = rank(seed, d, 0.03);
                let best = &all[0];
                assert_eq!(best.terms.len(), 1, "{name}: {:?}", best.terms);
                assert_eq!(best.terms[0].0.factors, factors, "{name}");
                let found = best.terms[0].1;
                assert!((found / size - 1.0).abs() < 0.05, "{name}: {found}");
                assert!(best.r2 > 0.9, "{name}: {}", best.r2);
            }
        }
    }

    #[test]
    fn a_formula_of_inputs_is_given_beside_one_of_what_answers_to_it() {
        // The third name is an unknown that follows what is missing closely.
        let follows = |seed| {
            let mut trace = trace(seed, |x| 1.3 * x[0], 0.05);
            trace.names[2] = trace.value.iter().map(|d| 2.0 + d).collect();
            trace
        };
        let all = ranked(&[follows(1)], &[follows(2)], [1, 3], &|_| true);
        let is_of_input =
            |ranked: &&RankedFormula| ranked.terms[0].0.factors == [(0, position("*{}"))];
        let found = all.iter().find(is_of_input).expect("the input");
        assert!(found.terms.len() == 1 && (found.terms[0].1 / 1.3 - 1.0).abs() < 0.05);
        assert!(all[0].terms.iter().any(|(shape, _)| shape.factors == [(2, 0)]));
    }

    #[test]
    fn laws_that_bend_at_a_place_of_their_own_are_found() {
        let forms: [(Missing, usize, &str, f64); 3] = [
            (|x| 1.1 * x[0] / (0.15 + x[0]), 0, "*{}/({b} + abs({}))", 1.1),
            (|x| 0.9 * (x[1] / 0.3).tanh(), 1, "*tanh({}/{b})", 0.9),
            (|x| 0.1 * (x[2] / 1.2).exp(), 2, "*exp({}/{b})", 0.1),
        ];
        for (d, name, text, size) in forms {
            for seed in 0..5 {
                let best = &rank(seed, d, 0.01)[0];
                let (shape, coefficient) = &best.terms[0];
                assert_eq!(shape.factors, [(name, position(text))], "{text}: {:?}", best.terms);
                // As close as the grid of the inner constant, with the parameter of the second name free; a fit refines
                // it.
                assert!((coefficient / size).ln().abs() < 2_f64.ln(), "{text}: {coefficient}");
                assert!(best.r2 > 0.8, "{text}: {}", best.r2);
            }
        }
    }

    #[test]
    fn what_comes_first_in_a_part_of_the_drawings_is_given() {
        // One name is a little off everywhere, and another far off in a tenth of the recording and nowhere else.
        let alike = |seed| {
            let mut trace = trace(seed, |x| 0.7 * x[0], 0.05);
            let (length, exact) = (SAMPLES / FOLDS, trace.names[0].clone());
            let off = |k: usize| (k as f64 / 13.0).sin();
            trace.names[0] = (0..SAMPLES).map(|k| exact[k] + 0.1 * off(k)).collect();
            let is_off = |k: usize| if k / length == 3 { 0.8 } else { 0.0 };
            trace.names[2] = (0..SAMPLES).map(|k| exact[k] + is_off(k) * off(k)).collect();
            trace
        };
        let all = ranked(&[alike(1)], &[], [1, 3], &|_| true);
        let is_of = |name: usize| {
            all.iter().any(|r| r.terms.len() == 1 && r.terms[0].0.factors == [(name, 0)])
        };
        assert!(is_of(0) && is_of(2), "{all:?}");
    }

    #[test]
    fn two_terms_are_found_where_one_is_not_enough() {
        let all = rank(3, |x| 1.2 * x[0] - 0.3 * x[2] * x[2], 0.03);
        let mut found: Vec<_> =
            all[0].terms.iter().map(|(shape, _)| shape.factors.clone()).collect();
        found.sort();
        assert_eq!(found, [vec![(0, 0)], vec![(2, 1)]]);
    }

    #[test]
    fn noise_looks_like_no_formula() {
        let none = (0..40).filter(|seed| rank(*seed, |_| 0.0, 1.0).is_empty()).count();
        assert_eq!(none, 40);
        // Nor does noise in recordings without validation data.
        for seed in 0..10 {
            let alone = ranked(&[trace(seed, |_| 0.0, 1.0)], &[], [1, 3], &|_| true);
            assert!(alone.is_empty(), "{alone:?}");
        }
    }
}
