//! What happens at moments: modes, events, switches.

#[path = "../support/exact.rs"]
mod exact;
#[path = "../support/inline.rs"]
mod inline;
#[path = "../support/recorded.rs"]
mod recorded;
#[path = "../support/mod.rs"]
mod support;

mod events;
mod fits;
mod hybrid;
mod impulses;
mod networks;
mod periodic;
mod profiles;
mod schedules;
mod steps;
mod switches;
mod tables;
