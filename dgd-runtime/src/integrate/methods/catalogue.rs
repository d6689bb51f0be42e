//! The integration methods, one entry each.

use std::fmt;

use crate::codegen::taylor::MOST_ORDER;
use crate::error::IntegrateError;
use crate::integrate::controller::ControlLaw;
use crate::integrate::methods::family::{FamilyTraits, MethodFamily, by_family};
use crate::integrate::methods::multistep::MAX_ORDER;
use crate::integrate::methods::tableaux::RosenbrockTableau;
use crate::integrate::methods::tableaux::RungeKuttaTableau;
use crate::integrate::methods::tableaux::{KENCARP4, RODAS4, RODAS5P, TSIT5};
use crate::integrate::methods::taylor;
use crate::linalg::AutoLu;
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::Signature;

/// An integration method.
#[derive(Debug)]
pub struct Method {
    /// Its name for users.
    pub name: &'static str,
    /// Its purpose, in one line.
    pub description: &'static str,
    /// Order of accuracy.
    pub order: u32,
    /// Source of its coefficients.
    pub source: &'static str,
    /// Its family, with coefficients.
    pub kind: MethodKind,
}

/// Families of methods.
#[derive(Debug, Clone, Copy)]
pub enum MethodKind {
    /// Linearly implicit Runge–Kutta.
    Rosenbrock(&'static RosenbrockTableau),
    /// Explicit Runge–Kutta.
    Explicit(&'static RungeKuttaTableau),
    /// Singly diagonally implicit Runge–Kutta with an explicit first stage.
    Esdirk(&'static RungeKuttaTableau),
    /// Backward differentiation, of orders up to this one.
    Bdf(usize),
    /// Taylor series, of this order or, if `None`, of the one that suits the tolerance.
    Taylor(Option<usize>),
}

impl MethodKind {
    /// Order of the solution to which error estimates belong, at the start.
    pub fn estimate_order(self, rtol: f64) -> u32 {
        by_family!(self, |family| family.estimate_order(rtol))
    }

    /// Whether it solves equations for the end of a step, so that models may be stiff and have algebraic unknowns.
    pub fn is_implicit(self) -> bool {
        self.traits().is_implicit()
    }

    /// The properties of its family.
    pub(crate) fn traits(self) -> FamilyTraits {
        by_family!(self, |family| traits_of(family))
    }

    /// How steps are controlled.
    pub(crate) fn law(self) -> ControlLaw {
        by_family!(self, |family| law_of(family))
    }

    /// Checks that the method of this name can solve a problem.
    pub(crate) fn verify<S: SolvableSystem>(
        self,
        problem: &Problem<'_, S>,
        name: &'static str,
    ) -> Result<(), IntegrateError> {
        by_family!(self, |family| family.verify(problem, name))
    }
}

fn traits_of<F: MethodFamily>(_: F) -> FamilyTraits {
    F::TRAITS
}

fn law_of<F: MethodFamily>(_: F) -> ControlLaw {
    F::LAW
}

/// All methods.
pub static METHODS: &[Method] = &[
    Method {
        name: "rodas5p",
        description: "L-stable Rosenbrock method for stiff, non-stiff and differential-algebraic models",
        order: 5,
        source: "Steinebach, BIT Numerical Mathematics 63 (2023) 27",
        kind: MethodKind::Rosenbrock(&RODAS5P),
    },
    Method {
        name: "rodas4",
        description: "L-stable Rosenbrock method with less work a step, for loose tolerances and inputs that end each step",
        order: 4,
        source: "Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.10",
        kind: MethodKind::Rosenbrock(&RODAS4),
    },
    Method {
        name: "kencarp4",
        description: "L-stable singly diagonally implicit Runge–Kutta method, few factorisations",
        order: 4,
        source: "Kennedy and Carpenter, Applied Numerical Mathematics 44 (2003) 139–181",
        kind: MethodKind::Esdirk(&KENCARP4),
    },
    Method {
        name: "bdf",
        description: "backward differentiation of order 1 to 5, for large stiff models",
        order: 5,
        source: "Shampine and Reichelt, SIAM Journal on Scientific Computing 18 (1997) 1–22",
        kind: MethodKind::Bdf(MAX_ORDER),
    },
    Method {
        name: "tsit5",
        description: "explicit Runge–Kutta method for models that are neither stiff nor algebraic",
        order: 5,
        source: "Tsitouras, Computers & Mathematics with Applications 62 (2011) 770–775",
        kind: MethodKind::Explicit(&TSIT5),
    },
    Method {
        name: "taylor",
        description: "Taylor series of an order by the tolerance, `taylor2` to `taylor31` of a given one; smooth models, not stiff",
        order: MOST_ORDER as u32,
        source: "Jorba and Zou, Experimental Mathematics 14 (2005) 99–117",
        kind: MethodKind::Taylor(None),
    },
];

/// Taylor methods of these orders.
macro_rules! taylor_of_order {
    ($($order:literal)*) => {
        [$(Method {
            name: concat!("taylor", $order),
            description: "Taylor series of this order, for smooth models that are not stiff",
            order: $order,
            source: "Jorba and Zou, Experimental Mathematics 14 (2005) 99–117",
            kind: MethodKind::Taylor(Some($order)),
        }),*]
    };
}

/// Taylor series of a given order, from [`taylor::LEAST_ORDER`] on.
static TAYLOR: [Method; MOST_ORDER - taylor::LEAST_ORDER + 1] = taylor_of_order![
    2 3 4 5 6 7 8 9 10 11 12 13 14 15 16
    17 18 19 20 21 22 23 24 25 26 27 28 29 30 31
];

/// Taylor series of orders up to this one, ascending.
pub(crate) fn taylor_up_to(order: usize) -> &'static [Method] {
    let count = (order + 1).saturating_sub(taylor::LEAST_ORDER).min(TAYLOR.len());
    &TAYLOR[..count]
}

/// The default method.
pub static DEFAULT: &Method = &METHODS[0];

/// Name of the choice by [`automatic`].
pub const AUTOMATIC: &str = "auto";

/// Number of unknowns up to which [`automatic`] always takes the default method.
pub const MOST_FOR_DEFAULT: usize = 1000;

/// The method for a model: `rodas5p`, whose errors are closest to the tolerance and which passes points where an
/// equation stops determining its unknown. For models of more than [`MOST_FOR_DEFAULT`] unknowns, none of them
/// algebraic, whose matrix is not banded: `bdf`, which evaluates and factorises least often, at the cost of errors ten
/// to a hundred times as large.
///
/// A banded matrix is cheap to factorise. It usually belongs to a line, for whose waves `bdf` may need a hundred times
/// as many steps: above order 2 it is not A-stable.
pub fn automatic(signature: &Signature) -> &'static Method {
    let n = signature.unknowns.len();
    let is_large = n > MOST_FOR_DEFAULT && signature.unknowns.n_algebraic() == 0;
    if is_large && !AutoLu::is_for_band(n, &signature.jacobian) {
        let mut large = METHODS.iter().filter(|method| method.kind.traits().is_multistep());
        large.next().unwrap_or(DEFAULT)
    } else {
        DEFAULT
    }
}

/// Finds a method by its name.
///
/// # Errors
///
/// [`UnknownMethod`], which lists the valid names.
pub fn find(name: &str) -> Result<&'static Method, UnknownMethod> {
    METHODS
        .iter()
        .chain(&TAYLOR)
        .find(|method| method.name == name)
        .ok_or_else(|| UnknownMethod { name: name.to_owned() })
}

/// Error for an unknown method name.
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
        let (least, most) = (TAYLOR[0].name, TAYLOR[TAYLOR.len() - 1].name);
        write!(f, ", of a given order `{least}` to `{most}`")?;
        Ok(())
    }
}

impl std::error::Error for UnknownMethod {}
