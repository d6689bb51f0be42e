//! Currents and voltages.

mod battery;
mod buck;
mod coil;
mod dc_motor;

use crate::bank::Domain;

pub(super) const ALL: &[&Domain] = &[&dc_motor::DOMAIN, &buck::DOMAIN, &battery::DOMAIN];
