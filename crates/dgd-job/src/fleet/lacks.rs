//! Missing terms of a well, and since when.

use super::reading::PeriodResults;

/// A missing term in the model of a well, at the last searched occasion.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AssetLack {
    /// The effect, or the equation of an unnamed one.
    pub(super) name: String,
    /// The first occasion since which every search has found it.
    pub(super) since: String,
    /// Its onset in the recordings of that occasion, s.
    pub(super) onset: Option<f64>,
    /// Whether only the last search found it, and an earlier one did not.
    pub(super) is_new: bool,
}

/// From a well's occasions, in order of time.
pub(super) fn collect(occasions: &[PeriodResults]) -> Vec<AssetLack> {
    let searched: Vec<_> =
        occasions.iter().filter_map(|found| Some((found, found.search.as_ref()?))).collect();
    let Some((_, last)) = searched.last() else { return Vec::new() };
    let lack = |(name, _): &(String, Option<f64>)| {
        let hits = searched
            .iter()
            .map(|(_, search)| search.missing.iter().find(|(known, _)| known == name));
        let hits: Vec<_> = hits.collect();
        let without = hits.iter().rposition(Option::is_none);
        let first = without.map_or(0, |place| place + 1);
        AssetLack {
            name: name.clone(),
            since: searched[first].0.when.clone(),
            onset: hits[first].and_then(|(_, onset)| *onset),
            is_new: first > 0 && first + 1 == searched.len(),
        }
    };
    last.missing.iter().map(lack).collect()
}

#[cfg(test)]
mod tests {
    use super::super::reading::SearchOutcome;
    use super::*;

    fn occasion(when: &str, missing: Option<&[&str]>) -> PeriodResults {
        let search = missing.map(|names| SearchOutcome {
            verdict: String::new(),
            missing: names.iter().map(|name| ((*name).to_owned(), Some(5.0))).collect(),
        });
        PeriodResults { when: when.to_owned(), search, ..PeriodResults::default() }
    }

    #[test]
    fn since_is_the_first_occasion_of_an_unbroken_row() {
        let occasions = [
            occasion("1", Some(&["a", "c"])),
            occasion("2", Some(&["a", "b"])),
            occasion("3", None),
            occasion("4", Some(&["b", "a"])),
            occasion("5", Some(&["a", "c", "b"])),
        ];
        let rows: Vec<(String, String, bool)> = collect(&occasions)
            .into_iter()
            .map(|lack| (lack.name, lack.since, lack.is_new))
            .collect();
        let row = |name: &str, since: &str, is_new| (name.to_owned(), since.to_owned(), is_new);
        assert_eq!(rows, [row("a", "1", false), row("c", "5", true), row("b", "2", false)]);
        assert_eq!(collect(&occasions[..3]).len(), 2, "an occasion without a search says nothing");
        assert!(collect(&occasions[2..3]).is_empty());
        // A term found by the only search may have been missing before.
        assert!(!collect(&occasions[..1])[0].is_new);
    }
}
