//! Vessels and reactors.

mod bioreactor;
mod co2_zones;
mod cstr;
mod pressure_vessel;
mod two_tanks;

use crate::bank::Domain;

pub(super) const ALL: &[&Domain] = &[
    &two_tanks::DOMAIN,
    &bioreactor::DOMAIN,
    &cstr::DOMAIN,
    &pressure_vessel::DOMAIN,
    &co2_zones::DOMAIN,
];
