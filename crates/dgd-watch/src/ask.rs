//! Requests of a page.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

/// The action to perform.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PageAction {
    /// Simulate.
    #[default]
    Run,
    /// Compute derivatives of the outputs.
    Sensitivities,
    /// Simulate, and keep the curves for comparison.
    Keep,
    /// Discard kept curves.
    Drop,
    /// Fit all parameters that are not fixed.
    Fit,
}

/// A request of a page, with all its choices.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PageRequest {
    /// The action to perform.
    #[serde(rename = "do")]
    pub act: PageAction,
    /// Choices of variants.
    pub variant: BTreeMap<String, String>,
    /// Applied effects.
    pub apply: Vec<String>,
    /// Values of parameters in their declared units; all others have the model's.
    pub values: BTreeMap<String, f64>,
    /// Numbers of kept curves to show or discard.
    pub kept: Vec<u32>,
    /// Keys of columns that the page already has.
    pub have: BTreeSet<String>,
}

impl PageRequest {
    /// Parses a request.
    ///
    /// # Errors
    ///
    /// A message about what is wrong with it.
    pub fn read(text: &[u8]) -> Result<PageRequest, String> {
        serde_json::from_slice(text).map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_as_the_model_has_it_and_what_is_unknown_is_refused() {
        let ask =
            PageRequest::read(br#"{"do":"keep","values":{"c0":2.5},"variant":{"flow":"static"}}"#);
        let ask = ask.expect("an ask");
        assert_eq!((ask.act, ask.values["c0"]), (PageAction::Keep, 2.5));
        assert_eq!(PageRequest::read(b"{}").expect("an ask"), PageRequest::default());
        for wrong in [&b"{\"write\":1}"[..], b"{\"do\":\"shell\"}", b"{\"values\":{\"a\":\"b\"}}"] {
            assert!(PageRequest::read(wrong).is_err());
        }
    }
}
