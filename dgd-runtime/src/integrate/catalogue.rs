//! The integration methods, one entry each.

use std::fmt;

use super::tableau::RosenbrockTableau;
use super::tableaux::RODAS5P;

/// An integration method.
#[derive(Debug)]
pub struct Method {
    /// What users call it.
    pub name: &'static str,
    /// What it is good for, in a line.
    pub description: &'static str,
    /// Order of accuracy.
    pub order: u32,
    /// Where its coefficients were read.
    pub source: &'static str,
    /// What the stepper needs to know.
    pub kind: MethodKind,
}

/// Families of methods.
#[derive(Debug)]
pub enum MethodKind {
    /// Linearly implicit Runge–Kutta.
    Rosenbrock(&'static RosenbrockTableau),
}

/// All methods.
pub static METHODS: &[Method] = &[Method {
    name: "rodas5p",
    description: "L-stable Rosenbrock method for stiff, non-stiff and differential-algebraic models",
    order: 5,
    source: "Steinebach, BIT Numerical Mathematics 63 (2023) 27",
    kind: MethodKind::Rosenbrock(&RODAS5P),
}];

/// The method used where none is named.
pub static DEFAULT: &Method = &METHODS[0];

/// Finds a method by its name.
///
/// # Errors
///
/// [`UnknownMethod`], which lists the names there are.
pub fn find(name: &str) -> Result<&'static Method, UnknownMethod> {
    METHODS
        .iter()
        .find(|method| method.name == name)
        .ok_or_else(|| UnknownMethod { name: name.to_owned() })
}

/// A name that no method has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownMethod {
    /// The name.
    pub name: String,
}

impl fmt::Display for UnknownMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no integration method is called `{}`; there are", self.name)?;
        for (i, method) in METHODS.iter().enumerate() {
            write!(f, "{} `{}`", if i == 0 { "" } else { "," }, method.name)?;
        }
        Ok(())
    }
}

impl std::error::Error for UnknownMethod {}
