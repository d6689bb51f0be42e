//! Identifies a structure by its candidates.

use std::fmt;

/// Maximum number of effects in one structure.
pub(crate) const MOST_EFFECTS: usize = 3;

/// A structure, identified by the positions of its candidates.
///
/// Structures are ordered by their lowest position, then by the next; of two that begin alike, the shorter comes first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct StructureId {
    /// Each position plus one, ascending, then zeros.
    effects: [u32; MOST_EFFECTS],
}

impl StructureId {
    /// The base model.
    pub(crate) const BASE: StructureId = StructureId { effects: [0; MOST_EFFECTS] };

    /// The structure with one candidate.
    pub(crate) fn one(candidate: usize) -> StructureId {
        StructureId::BASE.with_candidate(candidate)
    }

    /// Positions of the candidates, ascending.
    pub(crate) fn effects(self) -> impl Iterator<Item = usize> + Clone {
        self.effects.into_iter().take_while(|effect| *effect > 0).map(|effect| effect as usize - 1)
    }

    pub(crate) fn len(self) -> usize {
        self.effects().count()
    }

    pub(crate) fn is_base(self) -> bool {
        self == StructureId::BASE
    }

    pub(crate) fn contains(self, candidate: usize) -> bool {
        self.effects().any(|effect| effect == candidate)
    }

    /// Whether the other structure has all its candidates and more.
    pub(crate) fn is_part_of(self, whole: StructureId) -> bool {
        self.len() < whole.len() && self.effects().all(|effect| whole.contains(effect))
    }

    /// The structure with one more candidate. The search ensures that there are at most [`MOST_EFFECTS`].
    pub(crate) fn with_candidate(mut self, candidate: usize) -> StructureId {
        let last = self.len();
        self.effects[last] = candidate as u32 + 1;
        self.effects[..=last].sort_unstable();
        self
    }

    /// The structure without one of its candidates.
    pub(crate) fn without_candidate(self, candidate: usize) -> StructureId {
        self.effects().filter(|effect| *effect != candidate).collect()
    }
}

impl FromIterator<usize> for StructureId {
    fn from_iter<I: IntoIterator<Item = usize>>(candidates: I) -> Self {
        candidates.into_iter().fold(StructureId::BASE, StructureId::with_candidate)
    }
}

impl fmt::Debug for StructureId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.effects()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Vec<usize>> {
        let of = [0, 1, 2, 7, 300];
        let pairs =
            of.iter().flat_map(|a| of.iter().filter(move |b| a < *b).map(move |b| vec![*a, *b]));
        let mut all: Vec<Vec<usize>> = pairs.clone().collect();
        all.extend(of.map(|one| vec![one]));
        all.extend(pairs.flat_map(|pair| {
            of.iter()
                .filter(|c| pair[1] < **c)
                .map(|c| [&pair[..], &[*c]].concat())
                .collect::<Vec<_>>()
        }));
        all.push(Vec::new());
        all
    }

    #[test]
    fn structures_are_ordered_as_lists_of_positions_are() {
        let mut lists = all();
        let mut ids: Vec<StructureId> =
            lists.iter().map(|list| list.iter().rev().copied().collect()).collect();
        lists.sort();
        ids.sort();
        let sorted: Vec<Vec<usize>> = ids.iter().map(|id| id.effects().collect()).collect();
        assert_eq!(sorted, lists);
        // Keys of stored results contain this text.
        assert_eq!(format!("{ids:?}"), format!("{lists:?}"));
    }

    #[test]
    fn effects_come_and_go() {
        let both: StructureId = [5, 2].into_iter().collect();
        assert!(both.contains(5) && both.contains(2) && !both.contains(0) && both.len() == 2);
        assert_eq!(both.without_candidate(2), StructureId::one(5));
        assert_eq!(both.without_candidate(2).without_candidate(5), StructureId::BASE);
        assert_eq!(StructureId::one(2).with_candidate(5), both);
        assert!(StructureId::one(2).is_part_of(both) && StructureId::BASE.is_part_of(both));
        assert!(!both.is_part_of(both) && !StructureId::one(3).is_part_of(both));
    }
}
