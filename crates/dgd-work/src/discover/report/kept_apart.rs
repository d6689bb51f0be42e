//! Files of effects and formulas that are described but not in the corrected model.

use dgd_discover::Discovery;

/// Most effects described at a time, and most equations with a formula.
const DESCRIBED: usize = 2;
const LAWS: usize = 5;

/// The name of the file of a described effect.
pub(super) fn described(k: usize) -> String {
    format!("described_{}.dgd", k + 1)
}

/// The name of the file of a formula, by the rank of its missing term.
pub(super) fn law(k: usize) -> String {
    format!("law_{}.dgd", k + 1)
}

/// All possible names.
pub(super) fn names() -> impl Iterator<Item = String> {
    (0..DESCRIBED).map(described).chain((0..LAWS).map(law))
}

/// The files of a discovery.
pub(super) fn files(discovery: &Discovery) -> Vec<(String, String)> {
    let of_described = discovery.described.iter().enumerate();
    let of_described = of_described.map(|(k, one)| (described(k), one.file.clone()));
    let laws = discovery.unexplained.iter().enumerate();
    let laws = laws.filter_map(|(k, one)| Some((law(k), one.guess.as_ref()?.file.clone())));
    of_described.chain(laws).collect()
}
