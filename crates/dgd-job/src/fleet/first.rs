//! Triage: wells to look at, with reasons, the most urgent first.

use std::cmp::Ordering;

use dgd_work::with_unit;

use super::AssetResults;
use super::changes::ParameterChange;
use super::lacks::AssetLack;
use super::unlike::{AssetDistance, FleetComparison};

/// A reason to look at a well, the most urgent kind first.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum TriageReason {
    /// A missing term was found for the first time.
    Began(AssetLack),
    /// Parameters changed at the last occasion: the largest change, and the number of others.
    Moved(ParameterChange, usize),
    /// An outlier among the wells; the parameter, and its value here and the median, with the unit.
    Unlike(AssetDistance, String),
    /// Pieces failed: their number, the first one and its error.
    Failed(usize, String, String),
    /// A fit has not converged.
    Unconverged(String),
    /// A term has been missing for a while.
    Lacks(AssetLack),
}

impl TriageReason {
    /// Rank of its kind.
    fn rank(&self) -> usize {
        match self {
            TriageReason::Began(_) => 0,
            TriageReason::Moved(..) => 1,
            TriageReason::Unlike(..) => 2,
            TriageReason::Failed(..) => 3,
            TriageReason::Unconverged(_) => 4,
            TriageReason::Lacks(_) => 5,
        }
    }

    /// Its size, among its kind.
    fn size(&self) -> f64 {
        match self {
            TriageReason::Moved(change, _) => change.deviations,
            TriageReason::Unlike(distance, _) => distance.value,
            TriageReason::Failed(count, ..) => *count as f64,
            TriageReason::Began(_) | TriageReason::Unconverged(_) | TriageReason::Lacks(_) => 0.0,
        }
    }

    /// In a word, for programs.
    pub(super) fn kind(&self) -> &'static str {
        ["began", "moved", "unlike", "failed", "not_converged", "lacks"][self.rank()]
    }

    /// In a sentence.
    pub(super) fn words(&self) -> String {
        match self {
            TriageReason::Began(lack) => {
                format!("lacks {} since {}, not before", quoted(&lack.name), lack.since)
            }
            TriageReason::Moved(change, others) => {
                let others = match others {
                    0 => String::new(),
                    1 => "; another parameter moved, too".to_owned(),
                    n => format!("; {n} other parameters moved, too"),
                };
                format!(
                    "`{}` moved by {:.1} standard deviations from {} to {}{others}",
                    change.parameter, change.deviations, change.from, change.to
                )
            }
            TriageReason::Unlike(distance, what) => {
                format!(
                    "unlike the other wells, by {:.1} standard deviations: {what}",
                    distance.value
                )
            }
            TriageReason::Failed(1, what, why) => format!("{what} failed: {why}"),
            TriageReason::Failed(n, what, why) => {
                format!("{n} pieces failed, {what} among them: {why}")
            }
            TriageReason::Unconverged(why) => format!("the fit has not converged: {why}"),
            TriageReason::Lacks(lack) => {
                format!("lacks {} since {}", quoted(&lack.name), lack.since)
            }
        }
    }
}

/// Quotes the name of an effect, but not the description of an unknown term.
fn quoted(name: &str) -> String {
    if name.contains(' ') { name.to_owned() } else { format!("`{name}`") }
}

/// All reasons of all wells, the most urgent first; equal ones in the order of the wells.
pub(super) fn order(
    wells: &[AssetResults],
    compared: &FleetComparison,
    parameters: &[(String, String)],
) -> Vec<(usize, TriageReason)> {
    let mut ordered: Vec<(usize, TriageReason)> = Vec::new();
    for (w, well) in wells.iter().enumerate() {
        let distance = compared.distances.get(w).copied().flatten();
        ordered.extend(
            reasons(well, distance, compared, parameters).into_iter().map(|reason| (w, reason)),
        );
    }
    ordered.sort_by(|(a, one), (b, other)| {
        let size = || other.size().partial_cmp(&one.size()).unwrap_or(Ordering::Equal);
        one.rank().cmp(&other.rank()).then_with(size).then(a.cmp(b))
    });
    ordered
}

fn reasons(
    well: &AssetResults,
    distance: Option<AssetDistance>,
    compared: &FleetComparison,
    parameters: &[(String, String)],
) -> Vec<TriageReason> {
    let mut reasons: Vec<TriageReason> = Vec::new();
    for lack in &well.lacks {
        reasons.push(if lack.is_new {
            TriageReason::Began(lack.clone())
        } else {
            TriageReason::Lacks(lack.clone())
        });
    }
    let moved = well.changes.iter().filter(|change| change.is_last);
    if let Some(most) = moved.clone().max_by(|a, b| a.deviations.total_cmp(&b.deviations)) {
        reasons.push(TriageReason::Moved(most.clone(), moved.count() - 1));
    }
    if let Some(distance) = distance.filter(|distance| distance.is_unlike) {
        reasons
            .push(TriageReason::Unlike(distance, how_unlike(well, distance, compared, parameters)));
    }
    let failures: Vec<_> = well.occasions.iter().flat_map(|found| &found.failures).collect();
    if let Some((what, why)) = failures.first() {
        reasons.push(TriageReason::Failed(failures.len(), what.clone(), why.clone()));
    }
    let unconverged = well.occasions.iter().rev().find_map(|found| found.fit.as_ref());
    if let Some(Err(why)) = unconverged {
        reasons.push(TriageReason::Unconverged(why.clone()));
    }
    reasons
}

/// ``most in `c0`, which is 250 ± 3 m; the median is 275 m``.
fn how_unlike(
    well: &AssetResults,
    distance: AssetDistance,
    compared: &FleetComparison,
    parameters: &[(String, String)],
) -> String {
    let (name, unit) = &parameters[distance.most];
    let estimate = well.latest().and_then(|found| found.estimate(name));
    let place = compared.parameters.iter().position(|j| *j == distance.most);
    let (Some(estimate), Some(place)) = (estimate, place) else { return format!("`{name}`") };
    let estimated = with_unit(dgd_work::shown(estimate.value, estimate.std), unit);
    let middle = with_unit(dgd_work::shown(compared.medians[place], None), unit);
    format!("most in `{name}`, which is {estimated}; the median is {middle}")
}

#[cfg(test)]
mod tests {
    use super::super::reading::PeriodResults;
    use super::*;

    #[test]
    fn what_began_comes_before_what_moved_what_is_unlike_and_what_failed() {
        let lack =
            |is_new| AssetLack { name: "leak".into(), since: "2025".into(), onset: None, is_new };
        let change = |deviations| ParameterChange {
            parameter: "c".into(),
            from: "1".into(),
            to: "2".into(),
            by: 1.0,
            deviations,
            p_value: 0.0,
            is_last: true,
        };
        let well =
            |lacks: Vec<AssetLack>, changes: Vec<ParameterChange>, occasion: PeriodResults| {
                AssetResults { name: String::new(), occasions: vec![occasion], lacks, changes }
            };
        let failed = PeriodResults {
            failures: vec![("fit".into(), "no file".into())],
            ..PeriodResults::default()
        };
        let lost = PeriodResults { fit: Some(Err("flat".into())), ..PeriodResults::default() };
        let wells = [
            well(vec![lack(false)], vec![], failed),
            well(vec![], vec![change(6.0), change(7.0)], lost),
            well(vec![lack(true)], vec![change(9.0)], PeriodResults::default()),
        ];
        let order = order(&wells, &FleetComparison::default(), &[]);
        let kinds: Vec<(usize, &str)> =
            order.iter().map(|(w, reason)| (*w, reason.kind())).collect();
        assert_eq!(
            kinds,
            [
                (2, "began"),
                (2, "moved"),
                (1, "moved"),
                (0, "failed"),
                (1, "not_converged"),
                (0, "lacks")
            ]
        );
        assert_eq!(order[0].1.words(), "lacks `leak` since 2025, not before");
        assert!(order[2].1.words().ends_with("from 1 to 2; another parameter moved, too"));
        assert_eq!(order[3].1.words(), "fit failed: no file");
    }
}
