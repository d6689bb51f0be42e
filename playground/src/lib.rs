//! What the worker of the playground asks: the [`Bench`](dgd_watch::Bench) of `dgd watch`, with files that a page holds.
//!
//! ```text
//!   {"open":  {"files": {"m.dgd": "…"}, "model": "m.dgd", "data": "run.csv", "until": 60}}
//!   {"ask":   {"do": "run", "values": {"c0": 280}}}          as of `dgd watch`
//!   {"inputs": {}}                                            what the model must be given
//!   {"table": {"values": {}}}                                 all numbers of a run, with all digits
//!   {"discover": {"valid": "other.csv"}}                      what the model lacks, with the feature `discover`
//! ```
//!
//! Nothing is sent anywhere: there is nothing here that could.

pub mod exports;
mod room;

pub use room::Room;
