//! Fits structures: a structure, recordings and starting points in, estimates and residuals out.
//!
//! [`SearchData`] are the recordings with their noise, [`FittedStructure`] is a structure fitted to them. Expensive
//! results are stored ([`WorkJournal`]), and simulations that take too long are abandoned ([`most_steps`]).

mod budget;
mod correlated;
mod data;
mod diverging;
mod fitted;
mod foreseen;
mod held_out;
mod keeping;
mod moments;
mod noise_levels;
mod patience;
mod ranges;
mod ranking;
mod residuals;
mod start_point;

pub(crate) use budget::SearchBudget;
pub(crate) use data::SearchData;
pub(crate) use fitted::{FittedStructure, NoFit, VERY_STRONG, cost_at, with_starts};
pub(crate) use held_out::states_at;
pub(crate) use keeping::WorkJournal;
pub(crate) use noise_levels::noise_levels;
pub(crate) use patience::{most_steps, too_many_steps};
pub(crate) use ranges::{period, ranges};
pub(crate) use ranking::{
    StructureMethods, methods_for_ranking, options_for_ranking, stepping_alike,
};
pub(crate) use residuals::{
    as_far_as_readings, chi_square, mean, slack, whitened, whitened_square,
};
pub(crate) use start_point::StartPoint;
