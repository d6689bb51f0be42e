//! Effects that explain the recordings nearly as well as one that is believed.

use super::tried::Search;
use crate::library::StructureId;

/// An effect that explains the data nearly as well as the one that was named.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// Its name.
    pub name: String,
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
    /// nearly as well; the best first.
    pub(crate) fn alternatives(&self, whole: StructureId, candidate: usize) -> Vec<InItsPlace> {
        let rest = whole.without(candidate);
        let error = |of: StructureId| {
            let held_out = self.held_out_square(of);
            held_out.or_else(|| self.training_square(of)).map(f64::sqrt)
        };
        let Some(best) = error(whole) else { return Vec::new() };
        let own = self.candidates[candidate].name();
        let mut all: Vec<InItsPlace> = Vec::new();
        for other in 0..self.candidates.len() {
            let name = self.candidates[other].name();
            if rest.contains(other) || name == own || !self.is_open(other) {
                continue;
            }
            let exchanged = rest.with(other);
            let Some(ratio) = error(exchanged).map(|error| error / best) else { continue };
            let as_good = self.explains(exchanged) || !self.explains(whole);
            if ratio <= self.thresholds.alternative && as_good {
                let alternative = Alternative { name, valid_ratio: ratio };
                all.push(InItsPlace { alternative, candidate: other, structure: exchanged });
            }
        }
        all.sort_by(|a, b| a.alternative.valid_ratio.total_cmp(&b.alternative.valid_ratio));
        let mut names = Vec::new();
        all.retain(|InItsPlace { alternative, .. }| {
            let is_new = !names.contains(&alternative.name);
            names.push(alternative.name.clone());
            is_new
        });
        all
    }
}
