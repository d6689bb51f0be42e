//! Reports the condition outside which the base model holds.

use super::discovery::FoundRegime;
use super::found::parameters;
use super::model_spread::ModelSpread;
use crate::conditions::ConditionRegime;

/// A regime with the parameters from outside it.
pub(crate) fn found_regime(regime: ConditionRegime) -> FoundRegime {
    let ConditionRegime { condition, left: [outside, inside], outside: fitted } = regime;
    let parameters = parameters(&fitted, &ModelSpread::default(), &[]);
    FoundRegime { condition, outside, inside, parameters }
}
