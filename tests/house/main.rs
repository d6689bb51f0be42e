//! How the code is laid out: which crates and folders may use which, and that each file says what it is for.

mod dependencies;
mod layers;
mod purpose;
mod source;
mod unsafety;
