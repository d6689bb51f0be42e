//! Tests of the program as its users run it.

#[path = "../../../../tests/support/golden.rs"]
mod golden;
#[path = "../support/mod.rs"]
mod support;

mod accuracy;
mod begin;
mod commands;
mod compare;
mod conserved;
mod discover;
mod effects;
mod ensembles;
mod failures;
mod files;
mod fit_estimators;
mod fit_quality;
mod gates;
mod invert;
mod jobs;
mod large;
mod linearize;
mod lsp;
mod mend;
mod model_spread;
mod names;
mod options;
mod pages;
mod parts;
mod per_sample;
mod schema;
mod screen;
mod starts;
mod strangers;
mod told;
mod track;
mod unconverged;
mod verify;
#[cfg(feature = "watch")]
mod watch;
