//! Parameters of a well that changed between occasions by more than their uncertainty.

use dgd_screen::distribution::normal_two_sided;

use super::tail::f_tail;
use super::{AssetResults, CHANCE};

/// A changed parameter.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ParameterChange {
    pub(super) parameter: String,
    /// The earlier occasion, and the later one.
    pub(super) from: String,
    pub(super) to: String,
    /// The change, in the parameter's unit.
    pub(super) by: f64,
    /// The change in standard deviations of the difference.
    pub(super) deviations: f64,
    /// Probability of such a change by chance, by Student's t, because the noise is estimated from residuals.
    pub(super) p_value: f64,
    /// Whether it is the last occasion with estimates.
    pub(super) is_last: bool,
}

/// Finds significant changes in each well; in a fleet without changes, one is found with a probability of 1 %.
pub(super) fn find(wells: &mut [AssetResults]) {
    let changes: Vec<Vec<ParameterChange>> = wells.iter().map(steps).collect();
    let tests: usize = changes.iter().map(Vec::len).sum();
    if tests == 0 {
        return;
    }
    let least = CHANCE / tests as f64;
    for (well, steps) in wells.iter_mut().zip(changes) {
        well.changes = steps.into_iter().filter(|step| step.p_value < least).collect();
    }
}

/// All steps between successive occasions with estimates.
fn steps(well: &AssetResults) -> Vec<ParameterChange> {
    let known: Vec<_> = well.occasions.iter().filter(|found| !found.estimates.is_empty()).collect();
    let mut steps = Vec::new();
    for (k, pair) in known.windows(2).enumerate() {
        for (name, after) in &pair[1].estimates {
            let Some(before) = pair[0].estimate(name) else { continue };
            let (Some(a), Some(b)) = (before.std, after.std) else { continue };
            let difference = after.value - before.value;
            let deviations = difference.abs() / a.hypot(b);
            let freedom = pair[0].degrees_of_freedom.zip(pair[1].degrees_of_freedom);
            let p_value = match freedom {
                Some((before, after)) => f_tail(deviations * deviations, 1.0, before + after),
                None => normal_two_sided(deviations),
            };
            steps.push(ParameterChange {
                parameter: name.clone(),
                from: pair[0].when.clone(),
                to: pair[1].when.clone(),
                by: difference,
                deviations,
                p_value,
                is_last: k + 2 == known.len(),
            });
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::super::reading::{FleetEstimate, IntervalSource, PeriodResults};
    use super::*;

    fn well(values: &[f64]) -> AssetResults {
        let occasion = |(k, value): (usize, &f64)| {
            let estimate = FleetEstimate {
                value: *value,
                std: Some(1.0),
                band: None,
                by: IntervalSource::Std,
                unit: "m".into(),
            };
            PeriodResults {
                when: k.to_string(),
                estimates: vec![("c".into(), estimate)],
                ..PeriodResults::default()
            }
        };
        let occasions = values.iter().enumerate().map(occasion).collect();
        AssetResults { name: "w".into(), occasions, lacks: Vec::new(), changes: Vec::new() }
    }

    #[test]
    fn few_samples_ask_for_larger_steps() {
        let mut wells = vec![well(&[0.0, 4.2])];
        find(&mut wells);
        assert_eq!(wells[0].changes.len(), 1, "2.97 of a normal law are seldomer than 1 in 100");
        wells[0].occasions.iter_mut().for_each(|found| found.degrees_of_freedom = Some(3.0));
        find(&mut wells);
        // Student's t with 6 degrees of freedom exceeds 2.97 with a probability of 2.5 %.
        assert!(wells[0].changes.is_empty());
    }

    #[test]
    fn a_step_beyond_chance_is_found_and_more_tests_ask_for_more() {
        // 0.01 for two tests: 2.81 standard deviations of a difference, which is √2 of one.
        let mut wells = vec![well(&[0.0, 0.5, 5.0])];
        find(&mut wells);
        let [step] = wells[0].changes.as_slice() else { panic!("{:?}", wells[0].changes) };
        assert_eq!((step.from.as_str(), step.to.as_str(), step.is_last), ("1", "2", true));
        assert!((step.by - 4.5).abs() < 1e-12 && (step.deviations - 3.182).abs() < 1e-3);
        let quiet = (0..2000).map(|_| well(&[0.0, 0.5])).chain([well(&[0.0, 4.5])]);
        let mut wells: Vec<AssetResults> = quiet.collect();
        find(&mut wells);
        assert!(
            wells.iter().all(|well| well.changes.is_empty()),
            "one of 2001 may be so by chance"
        );
    }
}
