//! Things that move.

mod drone;
mod oscillator;
mod pendulum;
mod vehicle;

use crate::bank::Domain;

pub(super) const ALL: &[&Domain] =
    &[&oscillator::DOMAIN, &pendulum::DOMAIN, &drone::DOMAIN, &vehicle::DOMAIN];
