//! From the text of a .dgd model to a Program: syntax, units, structure, derivatives, Rust tokens.
