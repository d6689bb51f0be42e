//! What must come out, with the thesis' value, ours, and a verdict.

use crate::page::Section;

/// A finding of the thesis that must come out.
pub(crate) struct Claim {
    /// What is compared.
    pub(crate) what: &'static str,
    /// What the thesis says of it.
    pub(crate) thesis: &'static str,
    /// What is found here.
    pub(crate) here: String,
    /// Whether that is the finding, within the band that stands in the code.
    pub(crate) holds: bool,
}

/// What must come out, with what the thesis says and what is found.
pub(crate) fn claim(holds: bool, what: &'static str, thesis: &'static str, here: String) -> Claim {
    Claim { what, thesis, here, holds }
}

/// How many claims there are.
pub(crate) fn count(sections: &[Section]) -> usize {
    sections.iter().flat_map(|section| &section.findings).map(|f| f.claims.len()).sum()
}

/// Figure and claim of what does not come out, and figures that claim nothing.
pub(crate) fn missed(sections: &[Section]) -> Vec<String> {
    let mut missed = Vec::new();
    for finding in sections.iter().flat_map(|section| &section.findings) {
        if finding.claims.is_empty() {
            missed.push(format!("Fig {}: nothing is claimed", finding.number));
        }
        for claim in finding.claims.iter().filter(|claim| !claim.holds) {
            let Claim { what, thesis, here, .. } = claim;
            missed
                .push(format!("Fig {}: {what}: the thesis {thesis}, here {here}", finding.number));
        }
    }
    missed
}

/// Fails where something does not come out.
///
/// # Errors
///
/// What does not, line by line.
pub(crate) fn verdict(sections: &[Section]) -> Result<(), String> {
    let missed = missed(sections);
    if missed.is_empty() {
        return Ok(());
    }
    let count = missed.len();
    Err(format!("{count} of the thesis' findings do not come out:\n  {}", missed.join("\n  ")))
}
