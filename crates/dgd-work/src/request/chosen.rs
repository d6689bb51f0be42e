//! Reads choices on the command line, with their names and descriptions in its help.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use dgd_runtime::signature::NamedChoice;

/// The parser of a choice.
pub(super) fn parser<T: NamedChoice + Send + Sync>() -> impl TypedValueParser<Value = T> {
    let listed = |one: &T| {
        PossibleValue::new(one.name()).help(one.summary()).aliases(one.aliases().iter().copied())
    };
    let all: Vec<PossibleValue> = T::ALL.iter().map(listed).collect();
    PossibleValuesParser::new(all).map(|name| {
        T::from_name(&name).unwrap_or_else(|| unreachable!("clap lets only names of the list pass"))
    })
}
