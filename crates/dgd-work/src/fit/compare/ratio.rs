//! Likelihood ratios of nested contenders.
//!
//! ```text
//!   2 ln (L₁/L₀) ~ χ²   with as many degrees of freedom as the larger model has additional estimates
//! ```
//!
//! Source: Wilks, Ann. Math. Statist. 9 (1938) 60–62. Where the special case is at a bound of the larger one, the true
//! probability is smaller (Self & Liang, J. Amer. Statist. Assoc. 82 (1987) 605–610).

use dgd_screen::distribution::chi_square_tail;

use super::contender::NamedModel;
use super::score::ContenderScore;

/// Whether the larger of two contenders fits better than chance would explain.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct LikelihoodRatio {
    /// Position of the special case.
    pub null: usize,
    /// Position of the larger one.
    pub alternative: usize,
    /// 2 ln (L₁/L₀).
    pub statistic: f64,
    /// Number of additional estimates of the larger one.
    pub degrees_of_freedom: usize,
    /// Probability of such an improvement by chance.
    pub p_value: f64,
}

/// The ratios of all pairs that are nested by their effects, and of the first contender with each other one if the user
/// says that it is a special case of them.
pub(super) fn all(
    named: &[NamedModel],
    scores: &[ContenderScore],
    is_first_within: bool,
) -> Vec<LikelihoodRatio> {
    let mut ratios = Vec::new();
    for (null, one) in named.iter().enumerate() {
        for (alternative, other) in named.iter().enumerate() {
            let is_nested =
                one.is_within(other) || (is_first_within && null == 0 && alternative > 0);
            if is_nested {
                ratios.extend(compare(null, alternative, scores));
            }
        }
    }
    ratios
}

fn compare(null: usize, alternative: usize, scores: &[ContenderScore]) -> Option<LikelihoodRatio> {
    let (small, large) = (&scores[null], &scores[alternative]);
    let free_and_bound = |score: &ContenderScore| score.estimates + score.at_bounds;
    let degrees_of_freedom =
        free_and_bound(large).checked_sub(free_and_bound(small)).filter(|n| *n > 0)?;
    let statistic = small.deviance? - large.deviance?;
    let p_value = chi_square_tail(statistic, degrees_of_freedom as f64);
    Some(LikelihoodRatio { null, alternative, statistic, degrees_of_freedom, p_value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_nested_with_more_estimates_has_a_ratio() {
        let score = |deviance: f64, estimates| ContenderScore {
            deviance: Some(deviance),
            estimates,
            at_bounds: 0,
            samples: 100,
        };
        // χ²₂ beyond 5.991: probability 0.05.
        let scores = [score(105.991_464_5, 3), score(100.0, 5), score(90.0, 3)];
        let ratio = compare(0, 1, &scores).expect("a ratio");
        assert!((ratio.p_value - 0.05).abs() < 1e-6 && ratio.degrees_of_freedom == 2, "{ratio:?}");
        assert_eq!(compare(0, 2, &scores), None);
        assert_eq!(compare(1, 0, &scores), None);
    }
}
