//! A model as a page that is redrawn on every save, with sliders.
//!
//! ```text
//!   the page (assets/live.js) ── Ask ──► Bench ── answers as JSON ──► charts, controls, mistakes
//!                                          │
//!                                          └─ Prepared of dgd-work: compiled and read once, run again and again
//! ```
//!
//! A page asks and is answered: it holds what is chosen, and the [`Bench`] holds nothing but what is costly to make
//! again and the curves that were kept. So the same page and the same answers serve `dgd watch`, where the feature
//! `server` has them go by HTTP from this machine to this machine, and the playground, where a worker of the browser
//! is asked.
//!
//! What a page may write is one thing: values of parameters into the text of the model that was opened ([`Values`]).

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
pub use ask::{Ask, Do};
pub use bench::Bench;
pub use stop::Stop;
pub use values::{CannotWrite, Values};

/// The parts of the page that all who show it need: names of files, and what is in them.
pub fn assets() -> Vec<(&'static str, String)> {
    let mut all = dgd_page::live_assets().to_vec();
    all.push(("live.js", include_str!("../assets/live.js").to_owned()));
    all.push(("live.css", include_str!("../assets/live.css").to_owned()));
    all
}
