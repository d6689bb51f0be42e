//! Reports a law.

use dgd_identify::Recording;

use super::discovery::{FoundLaw, NearForm, RivalLaw};
use crate::fit::{Data, Fitted};
use crate::law::{Inserted, Law};
use crate::search::largest_disagreement;

/// A law with the constants of its last fit.
pub(crate) fn found_law(law: &Law, fitted: &Fitted) -> FoundLaw {
    let Law { inserted, near } = law;
    let near =
        near.iter().map(|(formula, ratio)| NearForm { formula: formula.clone(), ratio: *ratio });
    FoundLaw {
        terms: inserted.terms(fitted),
        ranges: inserted.ranges.clone(),
        near: near.collect(),
    }
}

/// Laws that explain the recordings alike.
pub(crate) fn rival_laws(all: &[Inserted], data: &Data<'_>) -> Vec<RivalLaw> {
    let apart = |k: usize, recording: &Recording| {
        let [first, other] = [&all[0].fitted, &all[k].fitted];
        let apart = largest_disagreement(first, other, recording, &data.options);
        apart.map_or_else(
            || "a test with other inputs".to_owned(),
            |apart| format!("a measurement of `{}`", apart.name),
        )
    };
    let rival = |(k, law): (usize, &Inserted)| {
        let (sum, n) = law.fitted.error;
        RivalLaw {
            terms: law.terms(&law.fitted),
            left: (sum / n as f64, law.fitted.held_out_square(data)),
            told_apart_by: data.train.first().filter(|_| k > 0).map(|first| apart(k, first)),
        }
    };
    all.iter().enumerate().map(rival).collect()
}
