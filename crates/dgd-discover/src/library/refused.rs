//! Candidates with which the model does not compile.

use std::ops::Range;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::{EffectApplication, EffectBlending, apply};
use dgd_runtime::parallel::in_parallel_stateless;

use super::candidates::EffectCandidate;
use super::structure::{BaseModel, StructureError};

/// Maximum number of candidates that are verified in one model: compilation grows faster than their number.
const VERIFIED_TOGETHER: usize = 24;

/// Groups of candidates in which none excludes another.
fn compatible(candidates: &[EffectCandidate<'_>], range: Range<usize>) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for one in range {
        let fits = |group: &&mut Vec<usize>| {
            group.len() < VERIFIED_TOGETHER
                && !group.iter().any(|other| candidates[*other].excludes(&candidates[one]))
        };
        match groups.iter_mut().find(fits) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    groups
}

impl BaseModel {
    /// The candidates of a range with which the model does not compile, with the reasons.
    pub(crate) fn refused(
        &self,
        all: &[EffectCandidate<'_>],
        range: Range<usize>,
        threads: usize,
    ) -> Vec<(usize, StructureError)> {
        let groups = compatible(all, range);
        let of_group = |k: usize| self.refused_of(all, &groups[k]);
        in_parallel_stateless(groups.len(), threads, of_group).into_iter().flatten().collect()
    }

    /// Those of some candidates, none of which excludes another, with which the model does not compile. All are
    /// compiled in one model, and in halves if that fails.
    fn refused_of(
        &self,
        all: &[EffectCandidate<'_>],
        some: &[usize],
    ) -> Vec<(usize, StructureError)> {
        let applications: Vec<EffectApplication<'_>> =
            some.iter().map(|&c| all[c].application.clone()).collect();
        let mut diagnostics = Diagnostics::default();
        let compiled = apply(&self.asts, &applications, EffectBlending::Applied, &mut diagnostics)
            .map_err(|_| StructureError::from_diagnostics(&diagnostics))
            .and_then(|applied| self.assemble(&applied.asts));
        match (compiled, some) {
            (Ok(_), _) | (_, []) => Vec::new(),
            (Err(refused), [candidate]) => vec![(*candidate, refused)],
            (Err(_), _) => {
                let (first, rest) = some.split_at(some.len() / 2);
                [self.refused_of(all, first), self.refused_of(all, rest)].concat()
            }
        }
    }
}
