//! All domains, by field.

mod electrical;
mod mechanical;
mod process;
mod thermal;

use crate::bank::Domain;

/// In the order in which cases are numbered; new ones go to the end.
pub(crate) fn all() -> Vec<&'static Domain> {
    [electrical::ALL, mechanical::ALL, process::ALL, thermal::ALL].concat()
}
