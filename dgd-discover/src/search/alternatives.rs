//! Effects that explain the recordings nearly as well as one that is believed.

use super::tried::Search;
use crate::library::StructureId;

/// An effect that explains the data nearly as well as the one that was named.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// Its name.
    pub name: String,
    /// Which realisation, where its family has several.
    pub form: Option<String>,
    /// Its validation error over that of the named one.
    pub valid_ratio: f64,
}

/// An effect in the place of another.
#[derive(Debug, Clone)]
pub(crate) struct InItsPlace {
    pub alternative: Alternative,
    /// Its position among the candidates.
    pub candidate: usize,
    /// The structure with it.
    pub structure: StructureId,
}

impl Search<'_> {
    /// Structures in which another effect stands in the place of one, and that predict validation data
    /// nearly as well; the best first, each effect once.
    pub(crate) fn alternatives(&self, whole: StructureId, candidate: usize) -> Vec<InItsPlace> {
        let mut all = self.in_its_place(whole, candidate);
        let own = self.candidates[candidate].name();
        let mut names = vec![own];
        all.retain(|InItsPlace { alternative, .. }| {
            let is_new = !names.contains(&alternative.name);
            names.push(alternative.name.clone());
            is_new
        });
        all
    }

    /// The same with other forms of the effect itself, each once.
    pub(crate) fn other_forms(&self, whole: StructureId, candidate: usize) -> Vec<Alternative> {
        let own = &self.candidates[candidate];
        let mut forms = vec![own.form()];
        let all = self.in_its_place(whole, candidate).into_iter().map(|one| one.alternative);
        let named = all.filter(|alternative| alternative.name == own.name());
        let is_unsaid = |alternative: &Alternative| {
            let is_new = !forms.contains(&alternative.form);
            forms.push(alternative.form.clone());
            is_new
        };
        named.filter(is_unsaid).collect()
    }

    /// All structures with another candidate in the place of one that predict validation data nearly as well, the best
    /// first.
    fn in_its_place(&self, whole: StructureId, candidate: usize) -> Vec<InItsPlace> {
        let rest = whole.without(candidate);
        let error = |of: StructureId| {
            let held_out = self.held_out_square(of);
            held_out.or_else(|| self.training_square(of)).map(f64::sqrt)
        };
        let Some(best) = error(whole) else { return Vec::new() };
        let mut all: Vec<InItsPlace> = Vec::new();
        for other in 0..self.candidates.len() {
            if rest.contains(other) || other == candidate || !self.is_open(other) {
                continue;
            }
            let exchanged = rest.with(other);
            let Some(ratio) = error(exchanged).map(|error| error / best) else { continue };
            let as_good = self.explains(exchanged) || !self.explains(whole);
            if ratio <= self.thresholds.alternative && as_good {
                let described = &self.candidates[other];
                let (name, form) = (described.name(), described.form());
                let alternative = Alternative { name, form, valid_ratio: ratio };
                all.push(InItsPlace { alternative, candidate: other, structure: exchanged });
            }
        }
        all.sort_by(|a, b| a.alternative.valid_ratio.total_cmp(&b.alternative.valid_ratio));
        all
    }
}
