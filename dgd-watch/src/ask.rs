//! What a page asks for.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

/// What is to be done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Do {
    /// Simulate.
    #[default]
    Run,
    /// Derivatives of the outputs.
    Sensitivities,
    /// Simulate, and keep the curves beside what follows.
    Keep,
    /// Forget kept curves.
    Drop,
    /// Fit what is not fixed.
    Fit,
}

/// What a page asks for, with all that is chosen there.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ask {
    /// What is to be done.
    #[serde(rename = "do")]
    pub act: Do,
    /// Choices of variants.
    pub variant: BTreeMap<String, String>,
    /// Effects that are applied.
    pub apply: Vec<String>,
    /// Values of parameters in their declared units; of all others the model's.
    pub values: BTreeMap<String, f64>,
    /// Numbers of kept curves that are shown, or forgotten.
    pub kept: Vec<u32>,
    /// Keys of columns that the page has.
    pub have: BTreeSet<String>,
}

impl Ask {
    /// Reads what a page sent.
    ///
    /// # Errors
    ///
    /// What is wrong with it.
    pub fn read(text: &[u8]) -> Result<Ask, String> {
        serde_json::from_slice(text).map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_as_the_model_has_it_and_what_is_unknown_is_refused() {
        let ask = Ask::read(br#"{"do":"keep","values":{"c0":2.5},"variant":{"flow":"static"}}"#);
        let ask = ask.expect("an ask");
        assert_eq!((ask.act, ask.values["c0"]), (Do::Keep, 2.5));
        assert_eq!(Ask::read(b"{}").expect("an ask"), Ask::default());
        for wrong in [&b"{\"write\":1}"[..], b"{\"do\":\"shell\"}", b"{\"values\":{\"a\":\"b\"}}"] {
            assert!(Ask::read(wrong).is_err());
        }
    }
}
