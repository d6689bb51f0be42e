//! The state of a search: tried structures and results.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use dgd_compiler::effects::AddedItems;
use dgd_runtime::System;

use super::evidence::WeighedEvidence;
use super::screen::Screen;
use super::thresholds::Thresholds;
use crate::fit::{FittedStructure, NoFit, SearchData};
use crate::library::{BaseModel, CarriedValues, EffectCandidate, StructureId};

/// A search and its results so far.
pub(crate) struct EffectSearch<'a> {
    pub base: &'a BaseModel,
    pub candidates: &'a [EffectCandidate<'a>],
    pub data: SearchData<'a>,
    pub threads: usize,
    /// The thresholds for verdicts.
    pub thresholds: Thresholds,
    pub tried: BTreeMap<StructureId, Result<FittedStructure, NoFit>>,
    /// Candidates that the search may use.
    pub open: OpenCandidates,
    /// Templates that are to first order equivalent to a library effect, or to another form at their place, with that
    /// effect.
    pub doubled: BTreeMap<usize, usize>,
    /// Screens, by the candidates and the structure.
    pub screens: BTreeMap<(OpenCandidates, StructureId), Screen>,
    /// Seed of resampling.
    pub seed: u64,
    /// Structures that their evidence contradicts, with the reasons.
    pub doubted: BTreeMap<StructureId, String>,
    /// Evidence for each effect of a structure.
    pub evidence: BTreeMap<StructureId, Vec<WeighedEvidence>>,
    /// Screens of the base model without refinement, by the candidates.
    pub base_screens: BTreeMap<OpenCandidates, Screen>,
    /// Whether candidates explain errors of the base model that could also be correlated noise.
    pub has_effects: bool,
    /// Parts of structures that were fitted from the end point of the whole, with the whole.
    pub settled: BTreeSet<(StructureId, StructureId)>,
    /// Structures whose fits do not come near the noise at the rate of their last round.
    pub lost: BTreeSet<StructureId>,
    /// Structures whose last round of a fit has gained next to nothing.
    pub at_rest: BTreeSet<StructureId>,
}

/// The candidates that a search may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum OpenCandidates {
    /// Those of the library.
    Library,
    /// Templates.
    Templates,
    /// Both, in one ranking.
    All,
}

impl OpenCandidates {
    /// The sets that are screened separately.
    pub(crate) fn parts(self) -> &'static [OpenCandidates] {
        match self {
            OpenCandidates::Library => &[OpenCandidates::Library],
            OpenCandidates::Templates => &[OpenCandidates::Templates],
            OpenCandidates::All => &[OpenCandidates::Library, OpenCandidates::Templates],
        }
    }
}

impl<'a> EffectSearch<'a> {
    /// A search without results.
    pub(crate) fn new(
        base: &'a BaseModel,
        candidates: &'a [EffectCandidate<'a>],
        data: SearchData<'a>,
        threads: usize,
        seed: u64,
    ) -> Self {
        EffectSearch {
            base,
            candidates,
            data,
            threads,
            seed,
            thresholds: Thresholds::default(),
            tried: BTreeMap::new(),
            open: OpenCandidates::Library,
            doubled: BTreeMap::new(),
            doubted: BTreeMap::new(),
            evidence: BTreeMap::new(),
            base_screens: BTreeMap::new(),
            has_effects: false,
            screens: BTreeMap::new(),
            settled: BTreeSet::new(),
            lost: BTreeSet::new(),
            at_rest: BTreeSet::new(),
        }
    }
}

impl EffectSearch<'_> {
    /// The fit of a structure, if it succeeded.
    pub(crate) fn fitted(&self, structure: StructureId) -> Option<&FittedStructure> {
        self.tried.get(&structure)?.as_ref().ok()
    }

    /// Parameters and start values of a structure.
    pub(crate) fn values(&self, structure: StructureId) -> CarriedValues {
        self.fitted(structure).map(|fitted| fitted.values.clone()).unwrap_or_default()
    }

    /// Positions of candidates.
    pub(crate) fn range(&self, of: OpenCandidates) -> Range<usize> {
        let first = self.candidates.partition_point(|candidate| !candidate.is_generic);
        match of {
            OpenCandidates::Library => 0..first,
            OpenCandidates::Templates => first..self.candidates.len(),
            OpenCandidates::All => 0..self.candidates.len(),
        }
    }

    /// Whether the search may use a candidate.
    pub(crate) fn is_open(&self, candidate: usize) -> bool {
        self.range(self.open).contains(&candidate)
    }

    /// Whether the templates of a structure are few enough to be a finding: at most two, at different places, of which
    /// one may depend on an arbitrary quantity. More of them can fit anything.
    pub(crate) fn may_be_said(&self, structure: StructureId) -> bool {
        let generic = structure.effects().map(|c| &self.candidates[c]).filter(|c| c.is_generic);
        match generic.collect::<Vec<_>>().as_slice() {
            [] | [_] => true,
            [one, other] => {
                one.target() != other.target()
                    && !(one.depends_on_a_quantity() && other.depends_on_a_quantity())
            }
            _ => false,
        }
    }

    /// The name of an effect, with its arguments.
    pub(crate) fn called(&self, candidate: usize) -> String {
        self.candidates[candidate].application.name()
    }

    /// Whether two candidates are different forms of one effect at one place.
    pub(crate) fn are_forms(&self, one: usize, other: usize) -> bool {
        let name = |c: usize| &self.candidates[c].application.effect.name.text;
        one != other && name(one) == name(other) && self.have_one_place(one, other)
    }

    /// Whether two candidates have the same arguments.
    pub(crate) fn have_one_place(&self, one: usize, other: usize) -> bool {
        let arguments = |c: usize| {
            let arguments = self.candidates[c].application.arguments.iter();
            arguments.map(|name| &name.text).collect::<Vec<_>>()
        };
        arguments(one) == arguments(other)
    }

    /// Whether two candidates are templates of one kind at one place.
    pub(crate) fn are_near(&self, one: usize, other: usize) -> bool {
        let [a, b] = [one, other].map(|c| &self.candidates[c]);
        a.is_generic && b.is_generic && a.target() == b.target() && a.kind() == b.kind()
    }

    /// The onset of an effect of a structure, s, if it has one.
    pub(crate) fn onset(&self, structure: StructureId, candidate: usize) -> Option<f64> {
        let fitted = self.fitted(structure)?;
        let brought = fitted.structure.brought_by(candidate)?;
        let onsets = &self.candidates[candidate].onsets;
        let (_, name) = brought.names.iter().find(|(own, _)| onsets.contains(own))?;
        fitted.values.p.get(name).copied()
    }

    /// Whether no parameter of an effect is at a bound.
    pub(crate) fn is_sound(&self, structure: StructureId) -> bool {
        self.fitted(structure).is_some() && self.at_bound(structure).is_empty()
    }

    /// Whether its fit has converged or no longer improves, if it has templates: an unfinished fit is not a finding.
    pub(crate) fn is_finished(&self, structure: StructureId) -> bool {
        let has_templates = structure.effects().any(|c| self.candidates[c].is_generic);
        let has_converged = || self.fitted(structure).is_some_and(|fitted| fitted.is_converged);
        !has_templates || self.at_rest.contains(&structure) || has_converged()
    }

    /// Effects of a structure with a parameter at a bound.
    pub(crate) fn at_bound(&self, structure: StructureId) -> Vec<usize> {
        let Some(fitted) = self.fitted(structure) else { return Vec::new() };
        let is_at_bound = |name: &String| {
            fitted.estimates.iter().any(|e| e.name == *name && fitted.is_at_bound(e))
        };
        let effects = structure.effects().zip(&fitted.structure.brought);
        let at_bound = effects.filter(|(effect, brought)| {
            let idle = self.idle(*effect, brought, fitted);
            let mut parameters = brought.parameters.iter();
            parameters.any(|name| is_at_bound(name) && !idle.contains(&name))
        });
        at_bound.map(|(effect, _)| effect).collect()
    }

    /// Parameters of an effect that stay at their null while another one acts, such as the lower limit of an input that
    /// reaches only the upper one.
    fn idle<'b>(
        &self,
        effect: usize,
        brought: &'b AddedItems,
        fitted: &FittedStructure,
    ) -> Vec<&'b String> {
        let declared = &fitted.structure.system.signature().parameters;
        let rests = |name: &str| {
            let brought_name = brought.names.iter().find(|(_, known)| known == name);
            let declared = declared.iter().find(|parameter| *parameter.name == *name);
            brought_name.is_some_and(|(brought_name, _)| {
                self.candidates[effect].is_declared_at_null(brought_name)
            }) && declared.is_some_and(|d| fitted.values.p.get(name) == Some(&d.value))
        };
        let idle: Vec<&String> = brought.null.iter().filter(|name| rests(name)).collect();
        if idle.len() == brought.null.len() { Vec::new() } else { idle }
    }
}
