//! The trait a compiled model implements, and what solves it.
