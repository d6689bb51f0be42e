//! Runs a compiled model without rustc.
