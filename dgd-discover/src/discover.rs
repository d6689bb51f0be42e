//! A discovery from beginning to end.
//!
//! ```text
//!   candidates: every way to apply the library          (candidates)
//!   search: fit, screen, refit, verdict                 (search, screen, fitted)
//!   what was found: size, onset, when, how sure         (activity, evidence)
//!   what is left over: the unknown input                (unknown_input)
//! ```

use std::collections::BTreeMap;
use std::fmt;

use dgd_compiler::diagnostics::{Diagnostics, Reported};
use dgd_compiler::effects::Effect;
use dgd_compiler::model::resolve;
use dgd_compiler::source::Sources;
use dgd_runtime::identify::{Recording, Watch};
use dgd_runtime::journal::{Digest, Journal};
use dgd_runtime::{Options, Steps};

use crate::account::{
    gap, given_up, left_over, not_tried, ranking_of, screened, traces, unexplained,
};
use crate::adapted::adapted;
use crate::candidates::{candidates, generic, unbound};
use crate::corrected::corrected;
use crate::discovery::{Discovery, FoundEffect, Ranked, Unexplained, Verdict};
use crate::evidence::p_value_of_the_base;
use crate::fitted::{Data, Fitted, NoFit};
use crate::found::{Found, parameters};
use crate::guess::Guessing;
use crate::keeping::Keeping;
use crate::known::Circumstances;
use crate::levels::ranges;
use crate::missing::{self, missing_inputs};
use crate::patience::most_steps;
use crate::reason::reason;
use crate::screen::StartPoint;
use crate::search::{Open, Search};
use crate::structure::{BaseModel, Values};
use crate::verdict::Outcome;
use crate::weights::noise_of;

/// What a discovery works on.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The model that may lack something.
    pub base: &'a BaseModel,
    /// Effects that it may lack.
    pub library: &'a [Effect],
    /// Templates that fit any model ([`templates`](crate::templates)), for what the library does
    /// not explain.
    pub templates: &'a [Effect],
    /// The texts of the model, the library and the templates.
    pub sources: &'a Sources,
    /// Recordings to fit to, one at least, with what they are called. Their start values are first
    /// guesses.
    pub train: (&'a [Recording], &'a [String]),
    /// Recordings kept out of the fits, with what they are called.
    pub valid: (&'a [Recording], &'a [String]),
    /// How to integrate.
    pub options: Options,
    /// Structures refitted at a time; the result does not depend on it.
    pub threads: usize,
    /// Seed of resampling.
    pub seed: u64,
    /// Keeps fits and screens, so that a run that was ended goes on where it was. The result does not
    /// depend on it.
    pub journal: &'a dyn Journal,
    /// Is told how far it is. A discovery is not stopped by it: half a search has no answer.
    pub watch: &'a dyn Watch,
}

impl Request<'_> {
    /// Digest of all that fits and screens depend on: texts, settings and recordings.
    pub fn digest(&self) -> Digest {
        let BaseModel { asts, options, free, fix, engine: _ } = self.base;
        let texts: Vec<&str> = self.sources.iter().map(|source| &*source.text).collect();
        Digest::EMPTY
            .of(&env!("CARGO_PKG_VERSION"))
            .of(&texts)
            .of(&(self.library.len(), self.templates.len()))
            .of(&(asts, options, free, fix))
            .of(&(self.train.0, self.valid.0))
            .of(&self.options)
    }
}

/// Why there is no discovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiscoverError {
    /// The model has mistakes, which were reported.
    Model(Reported),
    /// There is no recording to fit to.
    NoRecording,
    /// No output of the model was measured often enough to know its noise.
    NothingMeasured,
    /// The model cannot be fitted as it is.
    BaseModel(String),
}

impl fmt::Display for DiscoverError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Model(_) => f.write_str("the model has mistakes"),
            Self::NoRecording => f.write_str("there is no recording to fit to"),
            Self::NothingMeasured => {
                f.write_str("no output of the model was measured often enough to tell its noise")
            }
            Self::BaseModel(reason) => write!(f, "the model cannot be fitted as it is: {reason}"),
        }
    }
}

impl std::error::Error for DiscoverError {}

/// A tolerance that is fine enough to rank structures: no sensor is good to 1e-4 of what it reads.
const RANKING_TOLERANCE: f64 = 1e-4;

/// Simulations of the last fit of what is reported.
const LAST_EVALUATIONS: usize = 60;

/// Finds where a model and recordings disagree, and which known effect is missing.
///
/// # Errors
///
/// [`DiscoverError`]: the model cannot be fitted at all. Whatever else does not work is said in the
/// result.
pub fn discover(
    request: &Request<'_>,
    diagnostics: &mut Diagnostics,
) -> Result<Discovery, DiscoverError> {
    let Request { base, library, options, threads, .. } = *request;
    // Structures with events and without are compared, and all are to step alike.
    let steps = if options.steps == Steps::Automatic { Steps::Adaptive } else { options.steps };
    let options = Options { steps, ..options };
    let (train, valid) = (request.train.0, request.valid.0);
    if train.is_empty() {
        return Err(DiscoverError::NoRecording);
    }
    let model = resolve(&base.asts, &base.options, diagnostics).map_err(DiscoverError::Model)?;
    let mut left_out = unbound(library, &model);
    let mut candidates = candidates(library, &base.asts, &model);
    candidates.retain(|candidate| {
        let refusal = base.refusal(&model, candidate);
        left_out
            .extend(refusal.iter().map(|reason| (candidate.application.name(), reason.clone())));
        refusal.is_none()
    });
    let of_library = candidates.len();
    let noise = noise_of(train, &readings(train));
    if noise.iter().all(Option::is_none) {
        return Err(DiscoverError::NothingMeasured);
    }
    let ranking = Options {
        rtol: options.rtol.max(RANKING_TOLERANCE),
        atol: options.atol.max(RANKING_TOLERANCE),
        ..options
    };
    let is_kept = request.journal.is_of_use();
    let digest = if is_kept { request.digest() } else { Digest::EMPTY };
    let keeping = Keeping { journal: request.journal, watch: request.watch, request: digest };
    let mut data = Data {
        train,
        valid,
        noise,
        counts_from: Vec::new(),
        options: ranking,
        own_weights: false,
        keeping,
    };
    let failed = |NoFit(reason): NoFit| DiscoverError::BaseModel(reason);
    data.options.max_steps =
        most_steps(base, &data).map_err(|refused| DiscoverError::BaseModel(refused.0))?;
    let (fitted, data) = fitted_base(base, data, threads, request.seed).map_err(failed)?;
    let templates = adapted(request.templates, &model, train, &ranges(&fitted, &data));
    candidates.extend(generic(&templates, &base.asts));
    let tried = BTreeMap::from([(Vec::new(), Ok(fitted))]);
    let mut search =
        Search { tried, ..Search::new(base, &candidates, data, threads, request.seed) };
    let outcome = search.run();
    let (verdict, chosen) = match &outcome {
        Outcome::Sufficient => (Verdict::Sufficient, Vec::new()),
        Outcome::Effects(chosen) => (Verdict::Effects, chosen.clone()),
        Outcome::Partly(chosen) if search.is_specific(chosen) => (Verdict::Effects, chosen.clone()),
        Outcome::Partly(chosen) => (Verdict::Unexplained, chosen.clone()),
        Outcome::Unexplained(_) => (Verdict::Unexplained, Vec::new()),
    };

    let first = if of_library > 0 { Open::Library } else { Open::Templates };
    let mut screens = vec![search.screen_of_the_base(first)];
    let is_sufficient = verdict == Verdict::Sufficient;
    let p_value = p_value_of_the_base(&screens[0].trials, request.seed, is_sufficient);
    if (first, search.open) == (Open::Library, Open::Templates) {
        screens.push(search.screen_of_the_base(Open::Templates));
    }
    let [of_library, of_templates] = not_tried(&search, &screens, verdict);
    left_out.extend(of_library);
    let evidence = search.evidence(&chosen);
    let data = Data { options, ..search.data.clone() };
    // What is written is what a fit of it finds, which chooses its steps itself.
    let of_fit = Data { options: request.options, own_weights: true, ..search.data.clone() };
    let count = keeping.count("last fits", if chosen.is_empty() { 1 } else { 2 });
    let of_base = if verdict == Verdict::Sufficient { &of_fit } else { &data };
    let before = refined(&search, &[], of_base).map_err(failed)?;
    count.more(1);
    let after = match chosen.as_slice() {
        [] => before.clone(),
        chosen => refined(&search, chosen, &of_fit).map_err(failed)?,
    };
    count.more(1);
    let missing = missing_inputs(&model, base.engine, &before, &data);
    let circumstances = Circumstances::new(&before, &data);
    let effects = chosen.iter().zip(evidence).map(|(&c, evidence)| {
        let (search, data, chosen, after) = (&search, &data, &chosen, &after);
        let circumstances = &circumstances;
        Found { search, data, chosen, after, circumstances }.effect(c, evidence)
    });
    let effects: Vec<FoundEffect> = effects.collect();
    let unexplained = match (verdict, &outcome) {
        (Verdict::Unexplained, _) => {
            let most_likely = missing.first().map(|missing| {
                let windows = missing::windows(&model, base.engine, &before, &data, missing);
                let guessing = Guessing {
                    base,
                    sources: request.sources,
                    model: &model,
                    fitted: &before,
                    data: &data,
                };
                let condition = circumstances.condition(&windows);
                Unexplained { guess: guessing.guess(missing), ..unexplained(missing, condition) }
            });
            most_likely.into_iter().collect()
        }
        (Verdict::Effects, Outcome::Partly(_)) => {
            left_over(&data, &after, &circumstances).into_iter().collect()
        }
        (Verdict::Sufficient | Verdict::Effects, _) => Vec::new(),
    };
    let given_up = given_up(&search);
    let mut ranking = ranking_of(&search);
    ranking.extend(left_out.iter().map(|(name, why)| Ranked::refused(name, why)));
    Ok(Discovery {
        not_tried: unbound(request.templates, &model).into_iter().chain(of_templates).collect(),
        left_out,
        given_up,
        verdict,
        reason: reason(&search, &outcome, &before, &after, &data),
        p_value,
        effects,
        unexplained,
        gap: gap(&data, &before, &after, &circumstances),
        traces: traces(request, &data, &before, &after),
        missing,
        ranking,
        screened: screened(&search, &screens),
        base_parameters: parameters(&before, &[]),
        corrected_parameters: parameters(&after, &[]),
        corrected: corrected(request.base, request.sources, &after, diagnostics)
            .map_err(DiscoverError::Model)?,
    })
}

/// The base model, fitted, and the data with what its fit has told of the noise.
fn fitted_base<'a>(
    base: &'a BaseModel,
    data: Data<'a>,
    threads: usize,
    seed: u64,
) -> Result<(Fitted, Data<'a>), NoFit> {
    let mut search = Search::new(base, &[], data, threads, seed);
    search.fit_base(&Values::default())?;
    let fitted = search.tried.remove(&Vec::new());
    let fitted = fitted.unwrap_or_else(|| Err(NoFit("it was never fitted".to_owned())))?;
    Ok((fitted, search.data))
}

/// Readings of each recording and output; NaN where nothing was measured.
fn readings(recordings: &[Recording]) -> Vec<Vec<Vec<f64>>> {
    let of_recording = |recording: &Recording| {
        let missing = || vec![f64::NAN; recording.times.len()];
        let outputs = recording.measured.iter();
        outputs.map(|samples| samples.clone().unwrap_or_else(missing)).collect()
    };
    recordings.iter().map(of_recording).collect()
}

/// A structure that was tried, fitted to the end with the asked tolerance.
fn refined(search: &Search<'_>, chosen: &[usize], data: &Data<'_>) -> Result<Fitted, NoFit> {
    let Some(fitted) = search.fitted(chosen) else {
        return Err(NoFit("it was never fitted".to_owned()));
    };
    let structure = fitted.structure.clone();
    let points = [StartPoint::default()];
    let mut fitted = Fitted::new(structure, &fitted.values, &points, data, LAST_EVALUATIONS)?;
    fitted.know_correlations(data);
    fitted.hold_out(data, LAST_EVALUATIONS);
    Ok(fitted)
}
