//! The problems for all peers, and the protocol of their programs.
//!
//! | module | holds |
//! |---|---|
//! | [`two_state`] | P1, P2, P4, P5: a level and a flow, hand-written as for a library |
//! | [`mod@line`] | P3: a hydraulic line of n cells |
//! | [`request`] | requests of the driver, and answers |

pub mod line;
pub mod request;
pub mod two_state;
