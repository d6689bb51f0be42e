//! Heat.

mod heat_exchanger;
mod heated_room;

use crate::bank::Domain;

pub(super) const ALL: &[&Domain] = &[&heated_room::DOMAIN, &heat_exchanger::DOMAIN];
