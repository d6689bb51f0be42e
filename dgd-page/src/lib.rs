//! Pages to open in a browser: one design, no file besides, readable without JavaScript.
//!
//! ```text
//!   Figure of dgd-plot ─ chart ─┬─► SVG: what is read without JavaScript, and printed
//!                               └─► columns of numbers ─► curves with zoom and cursors (uPlot)
//!   text, tables, charts ─ Page ─► one HTML document
//! ```
//!
//! A page takes nothing from anywhere: its Content-Security-Policy allows the one script and the one style sheet that
//! are in it, by their hashes, and nothing else. Text from outside becomes [`Markup`] by being escaped, and numbers are
//! data that no script is made of, so that a name like `</script>` is a name. Equal contents give equal bytes.
//!
//! A page that a program keeps up to date is made of the same: [`LiveCharts`] has the figures, [`live_assets`] what
//! such a page fetches from the program.
//!
//! Knows names, units and verdicts only as text; writing the file is the caller's business.

mod assets;
mod chart;
mod columns;
mod hash;
mod markup;
mod page;
mod table;

pub use assets::live_assets;
pub use chart::{Link, LiveCharts};
pub use markup::Markup;
pub use page::{Origin, Page, Tone};
pub use table::{Cell, Table, heat_map};
