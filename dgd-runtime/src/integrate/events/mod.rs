//! Modes and conditions on time: changes at single points in time, and their consequences.
//!
//! A condition on time switches at a time that is known beforehand; a step ends there. A transition is due when its
//! event function e passes zero in its direction: within a step, which is then shortened to that point ([`locate`]), or
//! when inputs or other modes jump. A transition whose condition holds when its mode is entered acts only after the
//! condition has been false; it is *armed* from then on.
//!
//! All that happens at one time is one instant ([`saltation`]): one cause, and the transitions
//! that follow from it one after another until nothing is due.

mod hybrid;
mod jump;
mod locate;
mod past;
mod pieces;
mod reselect;
mod saltation;
mod scan;
mod simultaneous;
pub(in crate::integrate) mod singular_point;
mod ticks;
mod transitions;
mod watch;
mod within;

pub(in crate::integrate) use hybrid::HybridState;
pub(in crate::integrate) use jump::JumpWorkspace;
