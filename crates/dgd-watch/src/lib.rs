//! A live page for a model, with sliders, redrawn on every save.
//!
//! ```text
//!   the page (assets/live.js) ── Ask ──► Bench ── answers as JSON ──► charts, controls, mistakes
//!                                          │
//!                                          └─ Prepared of dgd-work: compiled and read once, run again and again
//! ```
//!
//! The page sends requests and stores the choices; the [`ModelBench`] only stores kept curves and results that are
//! expensive to recompute. So the same page and answers serve `dgd watch`, where the feature `server` transports them
//! by HTTP on the local machine, and the playground, where a web worker answers.
//!
//! A page can write only one thing: values of parameters into the text of the opened model ([`ParameterValues`]).

mod answer;
mod ask;
mod bench;
mod figures;
#[cfg(feature = "server")]
pub mod server;
mod stop;
#[cfg(test)]
mod tests;
mod values;

pub use answer::of_error;
pub use ask::{PageAction, PageRequest};
pub use bench::ModelBench;
pub use stop::StopHandle;
pub use values::{CannotWrite, ParameterValues};

/// The files of the page, by name, with their contents.
pub fn assets() -> Vec<(&'static str, String)> {
    let mut all = dgd_page::live_assets().to_vec();
    all.push(("live.js", include_str!("../assets/live.js").to_owned()));
    all.push(("live.css", include_str!("../assets/live.css").to_owned()));
    all
}
