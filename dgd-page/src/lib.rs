//! Self-contained pages for a browser: one design, readable without JavaScript.
//!
//! ```text
//!   Figure of dgd-plot ─ chart ─┬─► SVG: what is read without JavaScript, and printed
//!                               └─► columns of numbers ─► curves with zoom and cursors (uPlot)
//!   text, tables, charts ─ Page ─► one HTML document
//! ```
//!
//! A page loads nothing: its Content-Security-Policy allows only its own script and style sheet, by their hashes. Text
//! from outside becomes [`Markup`] by escaping, and numbers are data rather than script, so that a name like
//! `</script>` is just a name. Equal contents give equal bytes.
//!
//! A live page, which a program keeps up to date, is made of the same parts: [`LiveCharts`] has the figures,
//! [`live_assets`] the files that such a page fetches from the program.
//!
//! Knows names, units and verdicts only as text; writing the file is the caller's business.

mod assets;
mod chart;
mod columns;
mod markup;
mod page;
mod table;

pub use assets::live_assets;
pub use chart::{Link, LiveCharts};
pub use markup::Markup;
pub use page::{Origin, Page, Tone};
pub use table::{Cell, Table, heat_map};
