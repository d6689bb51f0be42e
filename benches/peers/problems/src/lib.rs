//! The problems that all peers solve, and how their programs answer.
//!
//! | module | holds |
//! |---|---|
//! | [`two_state`] | P1, P2, P4, P5: a level and a flow, by hand as a user of a library has to write them |
//! | [`mod@line`] | P3: a hydraulic line of n cells |
//! | [`request`] | what the driver asks a program, and the answer |

pub mod line;
pub mod request;
pub mod two_state;
