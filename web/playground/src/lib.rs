//! Answers the worker of the playground: the [`ModelBench`](dgd_watch::ModelBench) of `dgd watch`, with the files of a
//! page.
//!
//! ```text
//!   {"open":  {"files": {"m.dgd": "…"}, "model": "m.dgd", "data": "run.csv", "until": 60}}
//!   {"ask":   {"do": "run", "values": {"c0": 280}}}          as in `dgd watch`
//!   {"inputs": {}}                                            required inputs of the model
//!   {"table": {"values": {}}}                                 all numbers of a run, with all digits
//!   {"discover": {"valid": "other.csv"}}                      missing terms of the model, with the feature `discover`
//! ```
//!
//! No data leaves the page: this code has no network access.

pub mod exports;
mod room;

pub use room::Room;
