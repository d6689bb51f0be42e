//! Self-contained pages for a browser: one design, readable without JavaScript.
//!
//! ```text
//!   Figure of dgd-plot ─ chart ─┬─► SVG: for reading without JavaScript, and for print
//!                               └─► columns of numbers ─► curves with zoom and cursors (uPlot)
//!   text, tables, charts ─ Page ─► one HTML document
//! ```
//!
//! A page loads nothing: its Content-Security-Policy allows only its own script and style sheet, by their hashes. Text
//! from outside becomes [`Markup`] by escaping, and numbers are data rather than script, so that a name like
//! `</script>` is just a name. Equal contents give equal bytes.
//!
//! A live page, which a program updates, has the same parts: [`LiveCharts`] has the figures, [`live_assets`] the files
//! that the page fetches from the program.
//!
//! Names, units and verdicts are plain text here; the caller writes the file.

mod assets;
mod chart;
mod columns;
mod markup;
mod page;
mod table;

pub use assets::live_assets;
pub use chart::{ChartLink, LiveCharts};
pub use markup::Markup;
pub use page::{HeadlineTone, Page, PageOrigin};
pub use table::{PageCell, PageTable, heat_map};
