//! The description of a compiled model: the contract between the compiler and the solvers.
//!
//! The compiler makes a [`Signature`] and the functions that it describes; a solver reads it. All numbers
//! are in SI units. Generated models borrow their lists, loaded ones own them ([`List`], [`Text`]).
//!
//! | file | holds |
//! |---|---|
//! | `signature` | [`Signature`], and the directions of sensitivities |
//! | `quantity` | unknowns, parameters, inputs and outputs |
//! | `density` | how readings scatter around outputs |
//! | `prior` | what is known of a parameter beforehand |
//! | `unknowns` | names and units of all unknowns and equations, elements of arrays included |
//! | `arrays` | additions to a description by arrays |
//! | `pattern` | sparsity patterns of matrices |
//! | `discrete` | discrete state that changes at events, clocks, event functions as data, piecewise polynomials of tables |
//! | `past` | delayed inputs and unknowns |
//! | `features` | features that models of a type may have |
//! | `unit` | a declared unit |
//! | `choice` | enums of options, with their names |
//! | `number` | numbers in sentences |
//! | `special` | functions that the standard library lacks |

pub mod arrays;
mod choice;
mod density;
mod discrete;
mod features;
pub mod number;
mod past;
mod pattern;
mod prior;
mod quantity;
mod signature;
pub mod special;
mod unit;
mod unknowns;

use std::borrow::Cow;

pub use arrays::Arrays;
pub use choice::NamedChoice;
pub use density::{Density, Distribution};
pub use discrete::{
    Automaton, AutomatonKind, Clock, Crossing, Curve, Discrete, ExactTicks, Formulas, JumpKind,
    Operation, Transition, Trigger,
};
pub use features::Features;
pub use past::{DelayedInput, DelayedUnknown, PastLayout};
pub use pattern::Pattern;
pub use prior::PriorDensity;
pub use quantity::{Input, Interpolation, Output, Parameter, Unknown};
pub use signature::{Conserved, DifferentiatedInput, Direction, Signature, StartEquation};
pub use unit::Unit;
pub use unknowns::{Labels, Unknowns};

/// Text that a generated model borrows and a loaded one owns.
pub type Text = Cow<'static, str>;

/// A list that a generated model borrows and a loaded one owns.
pub type List<T> = Cow<'static, [T]>;

/// The command that installs dgd with all its features, for messages about one that a build lacks.
pub const FULL_BUILD: &str = "cargo install --path crates/dgd-cli --features full";
