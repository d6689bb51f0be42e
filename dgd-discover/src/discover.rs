//! The whole of a discovery on one page.

use std::fmt;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::model::resolve;
use dgd_runtime::Options;
use dgd_runtime::identify::Recording;

use crate::candidates::candidates;
use crate::fitted::Data;
use crate::search::{Outcome, Search, noise_of};
use crate::structure::{BaseModel, Values};

/// Recordings, and what they are called.
#[derive(Debug, Clone, Copy)]
pub struct Experiments<'a> {
    /// Recordings to fit to; one at least.
    pub train: &'a [Recording],
    /// Recordings that are kept out of the fits.
    pub valid: &'a [Recording],
}

/// Why there is no discovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiscoverError {
    /// The base model cannot be fitted.
    BaseModel(String),
}

impl fmt::Display for DiscoverError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BaseModel(reason) => write!(f, "the model cannot be fitted as it is: {reason}"),
        }
    }
}

impl std::error::Error for DiscoverError {}

pub fn discover(
    base: &BaseModel,
    library: &[Effect],
    experiments: Experiments<'_>,
    options: Options,
    threads: usize,
) -> Result<String, DiscoverError> {
    let mut diagnostics = Diagnostics::default();
    let model = resolve(&base.asts, &base.options, &mut diagnostics)
        .map_err(|_| DiscoverError::BaseModel("resolve".to_owned()))?;
    let candidates = candidates(library, &model);
    let Experiments { train, valid } = experiments;
    let readings: Vec<Vec<Vec<f64>>> = train
        .iter()
        .map(|recording| {
            let all = recording.measured.iter();
            all.map(|m| m.clone().unwrap_or_else(|| vec![f64::NAN; recording.times.len()]))
                .collect()
        })
        .collect();
    let noise = noise_of(train, &readings);
    let data = Data { train, valid, noise, options };
    let mut search = Search {
        base,
        candidates: &candidates,
        data,
        threads,
        tried: std::collections::BTreeMap::new(),
        screens: std::collections::BTreeMap::new(),
    };
    let outcome =
        search.run(&Values::default()).map_err(|error| DiscoverError::BaseModel(error.0))?;
    let mut text = String::new();
    use std::fmt::Write;
    let name = |s: &[usize]| s.iter().map(|c| candidates[*c].application.name()).collect::<Vec<_>>().join("+");
    for s in search.ranked() {
        let (a, n) = search.training_error(&s).unwrap();
        let (b, m) = search.held_out_error(&s).unwrap_or((f64::NAN, 1));
        let _ = writeln!(text, "{:10.4} {:10.4} {:8.1} {}  {:?}", a / n as f64, b / m as f64, search.bic(&s).unwrap() - search.bic(&[]).unwrap(), name(&s), search.fitted(&s).unwrap().values.p);
    }
    for (s, f) in &search.tried { if let Err(e) = f { let _ = writeln!(text, "failed {} {}", name(s), e.0); } }
    for (s, scores) in &search.screens {
        let _ = writeln!(text, "screen of [{}]: {}", name(s), scores.iter().map(|x| format!("{} {:.0}", candidates[x.candidate].application.name(), x.gain)).collect::<Vec<_>>().join(", "));
    }
    let _ = match &outcome { Outcome::Sufficient => writeln!(text, "sufficient"), Outcome::Effects(e) => writeln!(text, "effects {}", name(e)), Outcome::Unexplained(e) => writeln!(text, "unexplained, best {}", name(e)) };
    let _ = writeln!(text, "noise {:?}", search.data.noise.iter().map(|n| n.map(|n| n.std)).collect::<Vec<_>>());
    Ok(text)
}
