//! Solutions and their sensitivities, against other solutions.

#[path = "../support/inline.rs"]
mod inline;
#[path = "../support/mod.rs"]
mod support;

mod conserved;
mod domain;
mod ensembles;
mod generated;
mod index_reduction;
mod ivp_testset;
mod linearize;
mod printed_rows;
mod random_daes;
mod reference;
mod scaling;
mod sensitivity_references;
mod taylor;
mod weak_equations;
