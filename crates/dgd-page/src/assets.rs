//! Assets of every page: the style sheet, the script, and uPlot.

/// The library that draws curves: uPlot 1.6.32.
const UPLOT: &str = include_str!("../assets/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../assets/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../assets/uPlot.LICENSE");
const SCRIPT: &str = include_str!("../assets/page.js");
const STYLE: &str = include_str!("../assets/page.css");

/// The one style sheet of a page.
pub(crate) fn style() -> String {
    format!("\n{}\n{STYLE}", UPLOT_STYLE.trim())
}

/// The one script of a report's page.
pub(crate) fn script() -> String {
    format!("{}dgdPage.report();\n", library())
}

/// The code that draws charts and sorts tables, with the licence of third-party parts.
fn library() -> String {
    format!("\n/*!\n{}\n*/\n{}\n{SCRIPT}", UPLOT_LICENCE.trim(), UPLOT.trim())
}

/// Files that a live page fetches, by name: the style of reports, and the object `dgdPage`, whose functions draw
/// [`LiveCharts`](crate::LiveCharts).
pub fn live_assets() -> [(&'static str, String); 2] {
    [("page.css", style()), ("page.js", library())]
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use sha2::{Digest, Sha256};

    use super::*;

    #[test]
    fn what_others_wrote_is_as_they_published_it() {
        for (text, digest) in [
            (UPLOT, "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f"),
            (UPLOT_STYLE, "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04"),
            (UPLOT_LICENCE, "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd"),
        ] {
            let mut hex = String::new();
            for byte in Sha256::digest(text) {
                write!(hex, "{byte:02x}").expect("to a string");
            }
            assert_eq!(hex, digest);
        }
    }

    #[test]
    fn nothing_ends_the_elements_that_they_stand_in() {
        for text in [style(), script()] {
            for end in ["</script", "</style", "<!--"] {
                assert!(!text.to_ascii_lowercase().contains(end), "{end}");
            }
        }
    }

    #[test]
    fn a_page_without_data_has_less_than_150_kilobytes() {
        assert!(style().len() + script().len() < 120_000);
    }
}
