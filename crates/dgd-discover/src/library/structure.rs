//! A model with some candidates spliced in, compiled, with values.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use dgd_compiler::dae::{Dae, assemble};
use dgd_compiler::diagnostics::{Diagnostic, Diagnostics};
use dgd_compiler::effects::{
    AddedItems, EffectApplication, EffectBlending, ModelWithEffects, apply,
};
use dgd_compiler::model::{Model, ModelOptions, resolve};
use dgd_compiler::program::{Direction, lower};
use dgd_compiler::syntax::ast::Ast;
use dgd_execute::{Engine, LoadedSystem};
use dgd_identify::Starts;
use dgd_runtime::System;

use super::candidates::EffectCandidate;
use super::scale::OutputScales;
use super::structure_id::StructureId;

/// The model under examination.
#[derive(Debug, Clone)]
pub struct BaseModel {
    /// Its syntax tree, then those of its libraries.
    pub asts: Vec<Ast>,
    /// Variants and settings.
    pub options: ModelOptions,
    /// Parameters of the model to estimate (all that are not `fixed` if none is named), and states whose start values
    /// are estimated although they are `fixed`.
    pub free: Vec<String>,
    /// Parameters and start values not to estimate.
    pub fix: Vec<String>,
    /// How structures are run; the result does not depend on it.
    pub engine: Engine,
    /// The scales of its outputs, which a discovery chooses itself: [`OutputScales::default`] of a request.
    pub scales: OutputScales,
}

/// Values carried from one structure to the next, by name, SI.
#[derive(Debug, Clone, Default)]
pub(crate) struct CarriedValues {
    /// Parameters.
    pub p: BTreeMap<String, f64>,
    /// Start values of each recording.
    pub starts: Vec<BTreeMap<String, f64>>,
}

/// A structure ready to be simulated and fitted.
#[derive(Debug, Clone)]
pub(crate) struct ModelStructure {
    /// Its candidates.
    pub id: StructureId,
    /// Its syntax trees.
    pub asts: Vec<Ast>,
    /// The additions of each candidate, in the order of their positions.
    pub brought: Vec<AddedItems>,
    /// Positions of parameters that are onsets.
    pub onsets: Vec<usize>,
    /// Positions of parameters that are delays.
    pub delays: Vec<usize>,
    /// The compiled model; its directions are free parameters, then free start values.
    pub system: LoadedSystem,
}

/// Why a structure cannot be built.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StructureError {
    /// Its first error.
    first: Option<Box<Diagnostic>>,
}

impl BaseModel {
    /// The model with candidates applied, ready to be fitted.
    pub(crate) fn structure(
        &self,
        all: &[EffectCandidate<'_>],
        id: StructureId,
    ) -> Result<ModelStructure, StructureError> {
        let ModelWithEffects { asts, brought } = self.apply(all, id)?;
        let dae = self.assemble(&asts)?;
        let directions = self.free_directions(&dae, &brought);
        let free_ones = |of: for<'b> fn(&'b EffectCandidate<'_>) -> &'b [String]| -> Vec<usize> {
            let brought = id.effects().zip(&brought).flat_map(|(c, brought)| {
                let names = brought.names.iter().filter(move |(own, _)| of(&all[c]).contains(own));
                names.filter_map(|(_, name)| parameter(&dae, name))
            });
            brought.filter(|i| directions.contains(&Direction::Parameter(*i))).collect()
        };
        let (onsets, delays) = (free_ones(|c| &c.onsets), free_ones(|c| &c.delays));
        let system = LoadedSystem::with_engine(lower(&dae, &directions), self.engine);
        Ok(ModelStructure { id, asts, brought, onsets, delays, system })
    }

    /// The model with candidates applied and all others included at one of their nulls, with sensitivities to the
    /// parameters that switch each of the others on; and the additions of the others.
    pub(crate) fn screening(
        &self,
        all: &[EffectCandidate<'_>],
        structure: StructureId,
        others: &[usize],
        at_nothing: EffectBlending,
    ) -> Result<(LoadedSystem, Vec<AddedItems>), StructureError> {
        let base = self.apply(all, structure)?;
        let others: Vec<EffectApplication<'_>> =
            others.iter().map(|&c| all[c].application.clone()).collect();
        let mut diagnostics = Diagnostics::default();
        let ModelWithEffects { asts, brought } =
            apply(&base.asts, &others, at_nothing, &mut diagnostics)
                .map_err(|_| StructureError::from_diagnostics(&diagnostics))?;
        let dae = self.assemble(&asts)?;
        let directions: Vec<Direction> = brought
            .iter()
            .flat_map(|brought| brought.null.iter().chain(&brought.blend))
            .filter_map(|name| parameter(&dae, name).map(Direction::Parameter))
            .collect();
        Ok((LoadedSystem::with_engine(lower(&dae, &directions), self.engine), brought))
    }

    /// The reason why a candidate cannot be tried on recordings of this model, if any.
    pub(crate) fn refusal(&self, model: &Model, candidate: &EffectCandidate<'_>) -> Option<String> {
        let resolved =
            self.apply(std::slice::from_ref(candidate), StructureId::one(0)).and_then(|applied| {
                let mut diagnostics = Diagnostics::default();
                resolve(&applied.asts, &self.options, &mut diagnostics)
                    .map_err(|_| StructureError::from_diagnostics(&diagnostics))
            });
        let with_it = match resolved {
            Ok(with_it) => with_it,
            Err(error) => return Some(format!("cannot be applied: {error}")),
        };
        let is_known = |name: &String| model.inputs.iter().any(|own| own.declared.name == *name);
        let names = with_it.inputs.iter().map(|input| &input.declared.name);
        let unknown: Vec<String> =
            names.filter(|name| !is_known(name)).map(|name| format!("`{name}`")).collect();
        (!unknown.is_empty()).then(|| {
            format!("reads {}, of which the recordings have no column", unknown.join(" and "))
        })
    }

    fn apply(
        &self,
        all: &[EffectCandidate<'_>],
        structure: StructureId,
    ) -> Result<ModelWithEffects, StructureError> {
        let applications: Vec<EffectApplication<'_>> =
            structure.effects().map(|c| all[c].application.clone()).collect();
        let mut diagnostics = Diagnostics::default();
        apply(&self.asts, &applications, EffectBlending::Applied, &mut diagnostics)
            .map_err(|_| StructureError::from_diagnostics(&diagnostics))
    }

    pub(super) fn assemble(&self, asts: &[Ast]) -> Result<Dae, StructureError> {
        let mut diagnostics = Diagnostics::default();
        resolve(asts, &self.options, &mut diagnostics)
            .and_then(|model| {
                let model = self.scales.applied(self.scales.declared(model));
                assemble(&model, &mut diagnostics)
            })
            .map_err(|_| StructureError::from_diagnostics(&diagnostics))
    }

    /// Parameters and start values to estimate: those requested of the model, and those that the effects do not fix.
    fn free_directions(&self, dae: &Dae, brought: &[AddedItems]) -> Vec<Direction> {
        let named = |list: &[String], name: &str| list.iter().any(|listed| listed == name);
        let is_brought = |name: &str| brought.iter().any(|b| named(&b.parameters, name));
        let is_requested = |name: &String| parameter(dae, name).is_some_and(|_| !is_brought(name));
        let some_asked = self.free.iter().any(is_requested);
        let parameters = dae.parameters.iter().enumerate().filter(|(_, parameter)| {
            let name = &parameter.declared.name;
            if some_asked && !is_brought(name) { named(&self.free, name) } else { !parameter.fixed }
        });
        let parameters = parameters
            .filter(|(_, parameter)| !named(&self.fix, &parameter.declared.name))
            .map(|(i, _)| Direction::Parameter(i));
        let states = dae.unknowns.iter().enumerate().filter(|(_, state)| {
            let is_free = !state.fixed || named(&self.free, &state.name);
            state.differential && is_free && !named(&self.fix, &state.name)
        });
        // An array and one of its elements may both be named.
        let named: BTreeSet<usize> =
            self.free.iter().flat_map(|name| dae.positions(name)).collect();
        let is_element = |i: &usize| *i >= dae.unknowns.len() && dae.is_differential(*i);
        let elements = named.into_iter().filter(is_element);
        let starts = states.map(|(i, _)| i).chain(elements).map(Direction::Start);
        parameters.chain(starts).collect()
    }
}

impl ModelStructure {
    /// The additions of one of its candidates.
    pub(crate) fn brought_by(&self, candidate: usize) -> Option<&AddedItems> {
        let place = self.id.effects().position(|effect| effect == candidate)?;
        self.brought.get(place)
    }
}

impl StructureError {
    pub(super) fn from_diagnostics(diagnostics: &Diagnostics) -> StructureError {
        let first = diagnostics.sorted().first().map(|&first| Box::new(first.clone()));
        StructureError { first }
    }
}

impl fmt::Display for StructureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.first.as_ref().map_or("", |first| &first.message))
    }
}

fn parameter(dae: &Dae, name: &str) -> Option<usize> {
    dae.parameters.iter().position(|parameter| parameter.declared.name == name)
}

impl CarriedValues {
    /// All parameters of a system: these values where known, otherwise the model's.
    pub(crate) fn parameters(&self, system: &LoadedSystem) -> Vec<f64> {
        let parameters = system.signature().parameters.iter();
        parameters
            .map(|parameter| self.p.get(&*parameter.name).copied().unwrap_or(parameter.value))
            .collect()
    }

    /// Start values of a recording, by position of the unknown.
    pub(crate) fn starts(&self, system: &LoadedSystem, recording: usize) -> Starts {
        let Some(known) = self.starts.get(recording) else { return Starts::new() };
        let unknowns = system.signature().unknowns.iter().enumerate();
        unknowns
            .filter_map(|(i, unknown)| known.get(&*unknown.name).map(|value| (i, *value)))
            .collect()
    }

    /// Collects values by the names of a system.
    pub(crate) fn collect(system: &LoadedSystem, p: &[f64], starts: &[Starts]) -> CarriedValues {
        let signature = system.signature();
        let parameters = signature.parameters.iter();
        let p = parameters.zip(p).map(|(parameter, v)| (parameter.name.to_string(), *v)).collect();
        let named = |starts: &Starts| {
            let starts = starts.iter();
            starts.map(|(i, v)| (signature.unknowns.name(*i).to_string(), *v)).collect()
        };
        CarriedValues { p, starts: starts.iter().map(named).collect() }
    }
}
