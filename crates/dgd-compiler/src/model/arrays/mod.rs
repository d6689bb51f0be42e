//! Items of arrays and loops.
//!
//! | file | contents |
//! |---|---|
//! | `rows` | arrays of unknowns |
//! | `vector` | arrays of constants, parameters and inputs |
//! | `sweep` | equations of loops |
//! | `each` | other items in loops, once for each index |
//! | `output` | outputs of arrays |

mod each;
mod output;
mod rows;
mod sweep;
mod vector;
