//! Effects that explain the recordings nearly as well as an accepted one.

use std::collections::BTreeSet;

use super::tried::EffectSearch;
use crate::library::StructureId;

/// An effect that explains the data nearly as well as the named one.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// Its name.
    pub name: String,
    /// Its realisation, if its family has several.
    pub form: Option<String>,
    /// Its validation error relative to that of the named one.
    pub valid_ratio: f64,
}

/// An effect that replaces another.
#[derive(Debug, Clone)]
pub(crate) struct InItsPlace {
    pub alternative: Alternative,
    /// Its position among the candidates.
    pub candidate: usize,
    /// The structure with it.
    pub structure: StructureId,
}

/// All possible replacements of an effect, the best first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Replacements {
    /// Effects of other names, each once.
    pub others: Vec<InItsPlace>,
    /// Other forms of the effect itself, each once, however good.
    pub forms: Vec<Alternative>,
}

impl EffectSearch<'_> {
    /// Effects that may replace an effect of a structure and then predict validation data nearly as well, and its other
    /// forms.
    pub(crate) fn replacements(&self, whole: StructureId, candidate: usize) -> Replacements {
        let (rest, own) = (whole.without_candidate(candidate), &self.candidates[candidate]);
        let error = |of: StructureId| {
            let held_out = self.held_out_square(of);
            held_out.or_else(|| self.training_square(of)).map(f64::sqrt)
        };
        let Some(best) = error(whole) else { return Replacements::default() };
        let in_its_place = |other: usize| {
            if other == candidate || rest.contains(other) || !self.is_open(other) {
                return None;
            }
            let structure = rest.with_candidate(other);
            let valid_ratio = error(structure)? / best;
            let as_good = self.explains(structure) || !self.explains(whole);
            let described = &self.candidates[other];
            let (name, form) = (described.name(), described.form());
            let alternative = Alternative { name, form, valid_ratio };
            let is_form = described.name() == own.name();
            let is_one = is_form || valid_ratio <= self.thresholds.alternative && as_good;
            is_one.then_some(InItsPlace { alternative, candidate: other, structure })
        };
        let mut replacing: Vec<InItsPlace> =
            (0..self.candidates.len()).filter_map(in_its_place).collect();
        replacing.sort_by(|a, b| a.alternative.valid_ratio.total_cmp(&b.alternative.valid_ratio));

        let (mut said, mut forms_said) = (BTreeSet::new(), BTreeSet::from([own.form()]));
        let mut replacements = Replacements::default();
        for one in replacing {
            let Alternative { name, form, .. } = &one.alternative;
            if *name == own.name() {
                if forms_said.insert(form.clone()) {
                    replacements.forms.push(one.alternative);
                }
            } else if said.insert(name.clone()) {
                replacements.others.push(one);
            }
        }
        replacements
    }
}

#[cfg(test)]
mod tests {
    use super::super::draining::{id, leaving, with_effects};
    use super::*;

    #[test]
    fn other_effects_and_other_forms_of_the_same_one_are_kept_apart() {
        let names = ["density", "clock/late", "clock/early"];
        let (density, late, early) = (0, 1, 2);
        // The residuals of each, and the expected alternatives to the late clock and forms of it.
        let cases: [([f64; 2], &[&str], &[&str]); 4] = [
            ([1.02, 1.01], &["density"], &["early"]),
            ([1.02, 2.0], &["density"], &["early"]),
            ([2.0, 1.01], &[], &["early"]),
            ([2.0, 2.0], &[], &["early"]),
        ];
        for ([of_density, of_early], others, forms) in cases {
            with_effects(names, |base, candidates, data| {
                let left = [
                    (vec![], 400.0),
                    (vec![late], 1.0),
                    (vec![density], of_density),
                    (vec![early], of_early),
                ];
                let fitted = |(chosen, left): &(Vec<usize>, f64)| {
                    let structure = base.structure(candidates, id(chosen)).expect("a structure");
                    (id(chosen), Ok(leaving(*left, structure)))
                };
                let tried = left.iter().map(fitted).collect();
                let search =
                    EffectSearch { tried, ..EffectSearch::new(base, candidates, data, 1, 1) };
                let found = search.replacements(id(&[late]), late);
                let named = found.others.iter().map(|one| one.alternative.name.as_str());
                assert_eq!(named.collect::<Vec<_>>(), others);
                let of_itself = found.forms.iter().map(|one| one.form.as_deref().unwrap_or(""));
                assert_eq!(of_itself.collect::<Vec<_>>(), forms);
            });
        }
    }
}
