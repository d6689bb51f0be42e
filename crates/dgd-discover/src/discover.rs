//! A discovery from beginning to end.
//!
//! ```text
//!   prepare   a request            → the base model fitted, the noise, candidates
//!   search    candidates           → the structure found, and the evidence for it
//!   refine    that structure       → the base model and the corrected one, fitted to the end
//!   explain   both fits            → effects and when they act, and the rest
//!   report    all of it            → a Discovery
//! ```

use std::collections::BTreeMap;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::{Model, resolve};
use dgd_identify::Recording;
use dgd_identify::journal::Digest;
use dgd_runtime::Options;
use dgd_runtime::parallel::in_parallel;

use crate::conditions::{Circumstances, ConditionRegime};
use crate::fit::{
    FittedStructure, NoFit, SearchBudget, SearchData, StructureMethods, WorkJournal,
    methods_for_ranking, most_steps, noise_levels, options_for_ranking, period, ranges,
    stepping_alike,
};
use crate::guess::GuessData;
use crate::law::{
    AnsweringLaw, FittedTerms, LawAnswer, LawSearch, LawSearchResult, NamedTemplates,
};
use crate::library::{
    AdaptedTemplate, BaseModel, CarriedValues, EffectCandidate, OutputScales, StructureError,
    StructureId, TemplateScales, adapted, candidates, generic, unbound,
};
use crate::missing_input::{MissingInputs, missing_inputs};
use crate::noise::{noise_of, readings, without_lonely, without_spikes};
use crate::plain::{self, AnsweringCauses, PlainSearch};
use crate::report::{
    Discovery, EffectReport, FoundEffect, ModelSpread, RankedStructure, UnexplainedError,
    corrected, described, found_law, found_regime, gap, given_up, left_over, not_tried, parameters,
    plain_causes, power, ranking_of, reason, reason_of_law, rival_laws, screened, traces,
};
use crate::request::{DiscoverError, DiscoveryOptions};
use crate::search::{
    Alternative, EffectSearch, Evidence, JudgedOutcome, OpenCandidates, Screen, Verdict,
    p_value_of_the_base,
};
use crate::unexplained::WithoutName;

/// Maximum number of simulations in the final fit of a reported structure.
const LAST_EVALUATIONS: usize = 60;

/// Finds where a model and recordings disagree, and which known effect is missing.
///
/// # Errors
///
/// [`DiscoverError`]: the model cannot be fitted at all. All other failures are reported in the result.
pub fn discover(
    request: &DiscoveryOptions<'_>,
    diagnostics: &mut Diagnostics,
) -> Result<Discovery, DiscoverError> {
    discovered(request, None, diagnostics)
}

/// [`discover`] with given noise levels of each output in each recording, relative to their mean; `None` estimates
/// them.
fn discovered(
    request: &DiscoveryOptions<'_>,
    levels: Option<&[Vec<f64>]>,
    diagnostics: &mut Diagnostics,
) -> Result<Discovery, DiscoverError> {
    let unscaled = request;
    let [train, valid] = [request.train.0, request.valid.0];
    let scales = OutputScales::new(request.base, train, valid, levels);
    let scales = scales.map_err(DiscoverError::BaseModel)?;
    let uneven = scales.uneven();
    let fix = [request.base.fix.as_slice(), &scales.of_noise].concat();
    let base = &BaseModel { fix, scales, ..request.base.clone() };
    let scaled = base.scales.recordings(train, valid);
    let scaled = scaled.map_err(|error| DiscoverError::BaseModel(error.to_string()))?;
    let [train, valid] = scaled.as_ref().map_or([train, valid], |[train, valid]| [train, valid]);
    let request = &DiscoveryOptions {
        base,
        train: (train, request.train.1),
        valid: (valid, request.valid.1),
        ..*request
    };
    // No model explains isolated readings: fits and tests leave them out.
    let (train, of_train) = without_spikes(request.train.0);
    let (valid, of_valid) = without_spikes(request.valid.0);
    let mut lonely = sums(&[of_train, of_valid]);
    let mut cleaned = DiscoveryOptions {
        train: (&train, request.train.1),
        valid: (&valid, request.valid.1),
        ..*request
    };
    let mut prepared = prepare(&cleaned, diagnostics)?;
    let (train, valid, more) = without_what_stands_alone(&prepared);
    if more.iter().any(|number| *number > 0) {
        lonely = sums(&[lonely, more]);
        cleaned = DiscoveryOptions {
            train: (&train, request.train.1),
            valid: (&valid, request.valid.1),
            ..*request
        };
        prepared = prepare(&cleaned, diagnostics)?;
    }
    if levels.is_none()
        && let Some(levels) = noise_levels(&prepared.fitted, &prepared.data)
    {
        return discovered(unscaled, Some(&levels), diagnostics);
    }
    let candidates = prepared.candidates();
    let searched = search(&prepared, &candidates);
    let refined = refine(&prepared, &searched)?;
    let explained = explain(&prepared, &searched, &refined);
    let discovery = report(&prepared, &searched, refined, explained)?;
    Ok(Discovery { lonely, uneven, ..discovery })
}

/// The recordings without isolated spikes in the residuals of the base model, and the number of readings that each
/// output has lost.
fn without_what_stands_alone(
    prepared: &SearchInput<'_>,
) -> (Vec<Recording>, Vec<Recording>, Vec<usize>) {
    let SearchInput { fitted, data, .. } = prepared;
    let (train, of_train) = without_lonely(data.train, &fitted.residuals(data), &data.noise);
    let held_out = fitted.all_held_out_residuals(data).unwrap_or_default();
    let (valid, of_valid) = without_lonely(data.valid, &held_out, &data.noise);
    (train, valid, sums(&[of_train, of_valid]))
}

/// Element-wise sums.
fn sums(all: &[Vec<usize>]) -> Vec<usize> {
    let places = all.iter().map(Vec::len).max().unwrap_or(0);
    (0..places).map(|k| all.iter().filter_map(|one| one.get(k)).sum()).collect()
}

/// The input of a search.
struct SearchInput<'a> {
    request: &'a DiscoveryOptions<'a>,
    model: Model,
    /// Candidates of the library.
    of_library: Vec<EffectCandidate<'a>>,
    /// Effects of the library that cannot be tried, with the reasons.
    left_out: Vec<(String, String)>,
    /// Templates scaled to the recordings.
    templates: Vec<AdaptedTemplate>,
    /// The base model.
    fitted: FittedStructure,
    /// The recordings with their noise, and tolerances that are fine enough to rank structures.
    data: SearchData<'a>,
}

impl SearchInput<'_> {
    /// Candidates of the library, then templates.
    fn candidates(&self) -> Vec<EffectCandidate<'_>> {
        let mut candidates = self.of_library.clone();
        candidates.extend(generic(&self.templates, &self.request.base.asts));
        candidates
    }

    /// Integration options for reported structures. Structures with and without events are compared, so all must step
    /// alike.
    fn options(&self) -> Options {
        stepping_alike(self.request.options)
    }
}

/// The result of a search.
struct SearchResult<'a> {
    search: EffectSearch<'a>,
    outcome: JudgedOutcome,
    /// A law, if no effect explains the recordings.
    law: Option<Box<AnsweringLaw>>,
    /// Laws in different equations that explain the recordings equally well …
    rivals: Vec<FittedTerms>,
    /// … and the effects that do so too, and are therefore not named; the base model if there are none.
    doubted: StructureId,
    /// Equations that lack something together.
    lacking: Vec<String>,
    /// Plain causes, if they explain the recordings and come before effects and laws.
    plain: Option<Box<AnsweringCauses>>,
    /// Plain causes that explain the recordings as well as a named effect of the library.
    beside: Vec<Alternative>,
    /// Evidence for each effect of the named structure.
    evidence: Vec<Evidence>,
    /// Screens of the base model: candidates of the library, then templates if they were tried.
    screens: Vec<Screen>,
    /// Probability that the best of the first screen promises as much if nothing is missing.
    p_value: Option<f64>,
}

/// The base model and the corrected one, as reported.
struct RefinedModels<'a> {
    data: SearchData<'a>,
    before: FittedStructure,
    after: FittedStructure,
    /// Uncertainty of the estimates of both because of remaining model error.
    model_spreads: [ModelSpread; 2],
}

/// The effects found, and where the rest is missing.
struct ExplainedEffects {
    circumstances: Circumstances,
    missing: MissingInputs,
    effects: Vec<FoundEffect>,
    unexplained: Vec<UnexplainedError>,
    /// A base model that explains the recordings except while a condition holds.
    regime: Option<ConditionRegime>,
}

/// Fits the base model, and lists the candidates.
fn prepare<'a>(
    request: &'a DiscoveryOptions<'a>,
    diagnostics: &mut Diagnostics,
) -> Result<SearchInput<'a>, DiscoverError> {
    let DiscoveryOptions { base, library, .. } = *request;
    let train = request.train.0;
    if train.is_empty() {
        return Err(DiscoverError::NoRecording);
    }
    let model = resolve(&base.asts, &base.options, diagnostics).map_err(DiscoverError::Model)?;
    let model = base.scales.without_deviations(model);
    let mut left_out = unbound(library, &model);
    let mut of_library = candidates(library, &base.asts, &model);
    of_library.retain(|candidate| {
        let refusal = base.refusal(&model, candidate);
        left_out
            .extend(refusal.iter().map(|reason| (candidate.application.name(), reason.clone())));
        refusal.is_none()
    });
    let (fitted, data) = fit_base(request)?;
    let measure = TemplateScales { ranges: ranges(&fitted, &data), period: period(&fitted, &data) };
    let templates = adapted(request.templates, &model, train, &measure);
    Ok(SearchInput { request, model, of_library, left_out, templates, fitted, data })
}

/// The fitted base model, and the recordings with the noise estimated from its residuals.
fn fit_base<'a>(
    request: &'a DiscoveryOptions<'a>,
) -> Result<(FittedStructure, SearchData<'a>), DiscoverError> {
    let (train, valid) = (request.train.0, request.valid.0);
    let noise = noise_of(train, &readings(train));
    if noise.iter().all(Option::is_none) {
        return Err(DiscoverError::NothingMeasured);
    }
    let options = options_for_ranking(request.options);
    let is_kept = request.journal.is_of_use();
    let digest = if is_kept { request.digest() } else { Digest::EMPTY };
    let keeping = WorkJournal { journal: request.journal, watch: request.watch, request: digest };
    let (counts_from, own_weights) = (Vec::new(), false);
    let budget = SearchBudget::new(request.budget);
    let explicit = None;
    let scales = &request.base.scales;
    let mut data = SearchData {
        train,
        valid,
        noise,
        counts_from,
        options,
        explicit,
        own_weights,
        scales,
        budget,
        keeping,
    };
    let refused = |refused: StructureError| DiscoverError::BaseModel(refused.to_string());
    if !request.is_method_named {
        let StructureMethods { general, explicit } =
            methods_for_ranking(request.base, &data).map_err(refused)?;
        data.options.method = general;
        data.explicit = explicit;
    }
    data.options.max_steps = most_steps(request.base, &data).map_err(refused)?;
    let mut search = EffectSearch::new(request.base, &[], data, request.threads, request.seed);
    search.fit_base(&CarriedValues::default()).map_err(not_fitted)?;
    let fitted = search.tried.remove(&StructureId::BASE);
    let fitted = fitted.unwrap_or_else(|| Err(NoFit::NeverFitted));
    Ok((fitted.map_err(not_fitted)?, search.data))
}

/// Searches for effects that the base model lacks, with the evidence for them.
fn search<'a>(
    prepared: &'a SearchInput<'a>,
    candidates: &'a [EffectCandidate<'a>],
) -> SearchResult<'a> {
    let DiscoveryOptions { base, threads, seed, .. } = *prepared.request;
    let tried = BTreeMap::from([(StructureId::BASE, Ok(prepared.fitted.clone()))]);
    let search = EffectSearch::new(base, candidates, prepared.data.clone(), threads, seed);
    let mut search = EffectSearch { tried, ..search };
    let outcome = search.run();
    let (plain, beside) = plain_causes_of(prepared, &search, outcome);
    let is_plain = plain.as_ref().is_some_and(|plain| plain.is_white && !plain.are_of_recordings());
    let LawSearchResult { answer, lacking } =
        if is_plain { LawSearchResult::NOTHING } else { law(prepared, &search, outcome) };
    let (cost, is_law) = (answer.cost(), matches!(answer, LawAnswer::Law(_)));
    let holds = |plain: &AnsweringCauses| {
        let is_asked = is_law || plain.are_of_recordings();
        cost.filter(|_| is_asked).is_none_or(|cost| plain.holds_against(cost))
    };
    let plain = plain.filter(|plain| holds(plain));
    let doubted = match answer {
        LawAnswer::Doubt(_) if plain.is_none() => outcome.structure(),
        _ => StructureId::BASE,
    };
    let (law, rivals, outcome) = match answer {
        LawAnswer::Nothing => (None, Vec::new(), outcome),
        LawAnswer::Doubt(rivals) => (None, rivals, JudgedOutcome::Unexplained),
        LawAnswer::Law(law) => (Some(law), Vec::new(), JudgedOutcome::Unexplained),
    };
    let law = law.filter(|_| plain.is_none());
    let rivals = if plain.is_some() { Vec::new() } else { rivals };
    let outcome = if plain.is_some() { JudgedOutcome::Unexplained } else { outcome };
    let first = if prepared.of_library.is_empty() {
        OpenCandidates::Templates
    } else {
        OpenCandidates::Library
    };
    let mut screens = vec![search.screen_of_the_base(first)];
    let is_sufficient = outcome.verdict() == Verdict::Sufficient;
    let p_value = p_value_of_the_base(&screens[0].trials, seed, is_sufficient);
    if first == OpenCandidates::Library && search.open == OpenCandidates::All {
        screens.push(search.screen_of_the_base(OpenCandidates::Templates));
    }
    let evidence = search.evidence(outcome.structure());
    SearchResult {
        search,
        outcome,
        law,
        rivals,
        doubted,
        lacking,
        plain,
        beside,
        evidence,
        screens,
        p_value,
    }
}

/// Plain causes, if they come first, or those as good as an effect of the library.
fn plain_causes_of(
    prepared: &SearchInput<'_>,
    search: &EffectSearch<'_>,
    outcome: JudgedOutcome,
) -> (Option<Box<AnsweringCauses>>, Vec<Alternative>) {
    if outcome == JudgedOutcome::Sufficient || search.data.is_over() {
        return (None, Vec::new());
    }
    let SearchInput { request, model, .. } = prepared;
    let DiscoveryOptions { base, threads, train: (_, train), valid: (_, valid), .. } = **request;
    // With the noise that the search has found.
    let fitted = search.fitted(StructureId::BASE).unwrap_or(&prepared.fitted);
    let names = [train, valid];
    let plain = PlainSearch { base, model, fitted, names, data: &search.data, threads };
    match plain.answer(search, outcome) {
        plain::PlainAnswer::Nothing => (None, Vec::new()),
        plain::PlainAnswer::Beside(all) => (None, all),
        plain::PlainAnswer::First(causes) => (Some(causes), Vec::new()),
    }
}

/// Looks for a law if no effect of the library explains the recordings. It has to explain them better than templates
/// do.
fn law(
    prepared: &SearchInput<'_>,
    search: &EffectSearch<'_>,
    outcome: JudgedOutcome,
) -> LawSearchResult {
    let SearchInput { request, model, fitted, .. } = prepared;
    let DiscoveryOptions { base, sources, threads, .. } = **request;
    let named = outcome.structure();
    let mut effects = named.effects().map(|effect| &search.candidates[effect]);
    let is_generic = effects.clone().all(|effect| effect.is_generic);
    if outcome == JudgedOutcome::Sufficient || !is_generic || search.data.is_over() {
        return LawSearchResult::NOTHING;
    }
    // A law has to be better than templates only if they leave no more than noise.
    let explains = |fitted: &&FittedStructure| !named.is_base() && search.leaves_nothing(fitted);
    let is_noise = search.is_noise(named);
    let named = search.fitted(named).filter(explains).map(|fitted| NamedTemplates {
        fitted,
        is_noise,
        targets: effects.clone().map(EffectCandidate::target).collect(),
        effects: effects.clone().count(),
        are_sensors: effects.all(|effect| effect.kind() == "sensor"),
    });
    let data = &search.data;
    LawSearch { base, sources, model, fitted, data, threads }.search(search, named.as_ref())
}

/// Fits the base model and the structure found to the end.
fn refine<'a>(
    prepared: &'a SearchInput<'a>,
    searched: &SearchResult<'a>,
) -> Result<RefinedModels<'a>, DiscoverError> {
    let SearchResult { search, outcome, law, plain, .. } = searched;
    let data = SearchData { options: prepared.options(), explicit: None, ..search.data.clone() };
    // The corrected model gets the result of its own fit, which chooses its steps itself.
    let options = prepared.request.options;
    let of_fit = SearchData { options, explicit: None, own_weights: true, ..search.data.clone() };
    let named = outcome.structure();
    let tried = |structure: StructureId| {
        let fitted = search.fitted(structure).cloned();
        fitted.ok_or_else(|| not_fitted(NoFit::NeverFitted))
    };
    let of_base = if *outcome == JudgedOutcome::Sufficient { &of_fit } else { &data };
    let mut fits = vec![(tried(StructureId::BASE)?, of_base)];
    let of_plain = plain.as_ref().map(|plain| plain.all[0].data(&of_fit));
    if let Some((plain, of_plain)) = plain.as_ref().zip(of_plain.as_ref()) {
        fits.push((plain.all[0].fitted.clone(), of_plain));
    } else if let Some(law) = law {
        fits.push((law.inserted.fitted.clone(), &of_fit));
    } else if !named.is_base() {
        fits.push((tried(named)?, &of_fit));
    }
    let count = data.keeping.count("last fits", fits.len());
    let ended = in_parallel(&fits, fits.len(), prepared.request.threads, |fits, k| {
        let (fitted, data) = &fits[k];
        let ended = to_the_end(fitted, data);
        count.more(1);
        ended
    });
    let mut ended = ended.into_iter();
    let before = ended.next().expect("the base model comes first");
    // A model that diverges stays as it was.
    let before = before.unwrap_or_else(|_| fits[0].0.clone());
    let after = ended.next().transpose()?.unwrap_or_else(|| before.clone());
    let of_base = ModelSpread::from_structure(search, StructureId::BASE, &before, &data);
    let model_spread = if named.is_base() {
        of_base.clone()
    } else {
        ModelSpread::from_structure(search, named, &after, &data)
    };
    Ok(RefinedModels { data, before, after, model_spreads: [of_base, model_spread] })
}

/// Fits a structure to the end, with the requested tolerance.
fn to_the_end(
    fitted: &FittedStructure,
    data: &SearchData<'_>,
) -> Result<FittedStructure, DiscoverError> {
    let mut fitted = fitted.continued(data, LAST_EVALUATIONS).map_err(not_fitted)?;
    fitted.know_correlations(data);
    fitted.hold_out(data, LAST_EVALUATIONS);
    Ok(fitted)
}

/// Determines what each effect does and when, and locates what no effect explains.
fn explain(
    prepared: &SearchInput<'_>,
    searched: &SearchResult<'_>,
    refined: &RefinedModels<'_>,
) -> ExplainedEffects {
    let SearchInput { request, model, .. } = prepared;
    let SearchResult { search, outcome, evidence, .. } = searched;
    let RefinedModels { data, before, after, model_spreads: [_, model_spread] } = refined;
    let missing = missing_inputs(model, request.base.engine, before, data, request.threads);
    let circumstances = Circumstances::new(before, data);
    let structure = outcome.structure();
    let reporter = EffectReport {
        search,
        data,
        structure,
        after,
        model_spread,
        circumstances: &circumstances,
    };
    let effects =
        structure.effects().zip(evidence).map(|(c, evidence)| reporter.effect(c, *evidence));
    let mut effects: Vec<FoundEffect> = effects.collect();
    if let [only] = effects.as_mut_slice() {
        only.alternatives.extend(searched.beside.iter().cloned());
    }
    let unexplained = match outcome {
        JudgedOutcome::Sufficient | JudgedOutcome::Effects(_) => Vec::new(),
        JudgedOutcome::NearlyAll(_) => {
            let left = left_over(data, after, &circumstances, &search.thresholds);
            left.into_iter().collect()
        }
        JudgedOutcome::Most(_) | JudgedOutcome::Unexplained
            if searched.law.is_some() || searched.plain.is_some() =>
        {
            Vec::new()
        }
        JudgedOutcome::Most(_) | JudgedOutcome::Unexplained => {
            let (model, fitted) = (&prepared.model, before);
            let DiscoveryOptions { base, sources, threads, .. } = **request;
            let guessing = GuessData { base, sources, model, fitted, data, threads };
            let SearchResult { lacking, rivals, .. } = searched;
            let (guessing, circumstances) = (&guessing, &circumstances);
            WithoutName { guessing, circumstances, missing: &missing, lacking, rivals }.places()
        }
    };
    let is_open = matches!(outcome, JudgedOutcome::Most(_) | JudgedOutcome::Unexplained);
    let condition = unexplained.first().filter(|_| is_open && !data.is_over());
    let regime = condition.and_then(|first| first.condition.as_ref()).and_then(|condition| {
        let explained = search.thresholds.explained;
        ConditionRegime::find(condition, &circumstances, before, data, explained)
    });
    ExplainedEffects { circumstances, missing, effects, unexplained, regime }
}

/// Assembles the result.
fn report(
    prepared: &SearchInput<'_>,
    searched: &SearchResult<'_>,
    refined: RefinedModels<'_>,
    explained: ExplainedEffects,
) -> Result<Discovery, DiscoverError> {
    let SearchInput { request, model, .. } = prepared;
    let SearchResult { search, outcome, law, plain, screens, .. } = searched;
    let verdict = match (plain, law) {
        (Some(_), _) => Verdict::Plain,
        (None, Some(_)) => Verdict::Law,
        (None, None) => outcome.verdict(),
    };
    let RefinedModels { data, before, after, model_spreads: [of_base, of_corrected] } = refined;
    // If columns are at fault, the corrected model is compared with the corrected recordings.
    let first = plain.as_ref().map(|plain| &plain.all[0]);
    let data_after = first.map_or_else(|| data.clone(), |first| first.data(&data));
    let request_after = DiscoveryOptions {
        train: (data_after.train, request.train.1),
        valid: (data_after.valid, request.valid.1),
        ..**request
    };
    let ExplainedEffects { circumstances, missing, effects, unexplained, regime } = explained;
    let [of_library, of_templates] = not_tried(search, screens, verdict);
    let left_out: Vec<_> = prepared.left_out.iter().cloned().chain(of_library).collect();
    let sources = law.as_ref().map_or(request.sources, |law| &law.inserted.sources);
    let mut ranking = ranking_of(search);
    ranking.extend(left_out.iter().map(|(name, why)| RankedStructure::refused(name, why)));
    Ok(Discovery {
        not_tried: unbound(request.templates, model).into_iter().chain(of_templates).collect(),
        left_out,
        given_up: given_up(search),
        power: if verdict == Verdict::Sufficient { power(search, &screens[0]) } else { Vec::new() },
        lonely: Vec::new(),
        uneven: Vec::new(),
        is_cut_short: data.is_spent(),
        verdict,
        reason: if plain.is_some() || law.is_some() {
            reason_of_law((&before, &data), (&after, &data_after))
        } else {
            reason(search, *outcome, &before, &after, &data)
        },
        p_value: searched.p_value,
        effects,
        law: law.as_ref().map(|law| found_law(law, &after)),
        regime: regime.map(found_regime),
        rivals: rival_laws(&searched.rivals, search, searched.doubted),
        plain: plain
            .as_ref()
            .map(|causes| plain_causes(causes, &after, [request.train.1, request.valid.1])),
        described: outcome.described().map_or_else(Vec::new, |one| described(search, one)),
        unexplained,
        gap: gap((&before, &data), (&after, &data_after), &circumstances),
        traces: traces(&request_after, &data_after, &before, &after),
        missing: missing.ranked.into_iter().map(|found| found.missing).collect(),
        closed: missing.terms.map_or_else(Vec::new, |terms| terms.closed().to_vec()),
        nowhere: missing.reason,
        ranking,
        screened: screened(search, screens),
        base_parameters: parameters(&before, &of_base, &[]),
        corrected_parameters: parameters(&after, &of_corrected, &[]),
        corrected: corrected(request.base, sources, &after)?,
    })
}

#[expect(clippy::needless_pass_by_value, reason = "errors are handed over so")]
fn not_fitted(reason: NoFit) -> DiscoverError {
    DiscoverError::BaseModel(reason.to_string())
}
