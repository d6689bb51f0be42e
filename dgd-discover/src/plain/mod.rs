//! Plain causes: what a user asks first when a model and recordings disagree, before any effect.
//!
//! ```text
//!   the model's text ─► each constant, each parameter that is not estimated      (numbers)
//!     ─► the model with it estimated, from its value and from those that
//!        a slip of the unit would give                                           (trial)
//!     ─► those that leave only noise, the likeliest first, with their twins      (judged)
//! ```
//!
//! A cause is an answer only if it leaves no more than noise, and if no effect or law is clearly more likely.

mod judged;
mod numbers;
mod trial;

use dgd_compiler::model::Model;

use crate::fit::{Data, Fitted};
use crate::library::BaseModel;
use crate::search::Search;
pub(crate) use judged::{Answer, Causes};
pub(crate) use numbers::Number;

/// The data for a search.
#[derive(Clone, Copy)]
pub(crate) struct Plain<'a> {
    pub(crate) base: &'a BaseModel,
    pub(crate) model: &'a Model,
    pub(crate) fitted: &'a Fitted,
    pub(crate) data: &'a Data<'a>,
    pub(crate) threads: usize,
}

/// What may be wrong.
#[derive(Debug, Clone)]
pub(crate) enum Suspicion {
    /// A number of the model's text.
    Number(Number),
}

/// A suspicion with the model that has what is suspected as it may be.
#[derive(Debug, Clone)]
struct Suspect {
    suspicion: Suspicion,
    base: BaseModel,
}

/// A suspicion, fitted.
#[derive(Debug, Clone)]
pub(crate) struct Cause {
    pub(crate) suspicion: Suspicion,
    pub(crate) fitted: Fitted,
}

impl Plain<'_> {
    /// Causes that leave only noise, the likeliest first.
    pub(crate) fn search(&self, search: &Search<'_>) -> Vec<Cause> {
        let suspects = numbers::suspects(self.base, self.model, self.fitted);
        self.explaining(search, &suspects)
    }
}
