//! The compiler's stages, what is written of them, and how much work models are.

#[path = "../support/golden.rs"]
mod golden;
#[path = "../support/inline.rs"]
mod inline;
#[path = "../support/mod.rs"]
mod support;

mod docs;
mod first_guesses;
mod invariance;
mod model_pages;
mod mutations;
mod pipeline;
mod work;
