//! Equations at single points, and residuals of fits: for solvers and optimisers in Python.

use std::sync::{Mutex, MutexGuard, PoisonError};

use dgd_runtime::Unit;
use dgd_work::{At, WorkError};
use pyo3::prelude::*;

use crate::errors::Task;
use crate::guard::guarded;
use crate::numbers::Numbers;

/// Names and units.
type Names = Vec<(String, String)>;

/// A time in s, unknowns, inputs and parameters; missing ones are those of the recording and of the model.
#[derive(FromPyObject)]
struct Point(f64, Numbers, Option<Numbers>, Option<Numbers>);

/// The equations of a model, evaluated point by point in declared units. Matrices come row by row.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Equations {
    inner: Mutex<dgd_work::Equations>,
}

impl Equations {
    pub(crate) fn new(inner: dgd_work::Equations) -> Self {
        Equations { inner: Mutex::new(inner) }
    }

    fn inner(&self) -> MutexGuard<'_, dgd_work::Equations> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Evaluates a function at a point.
    #[allow(clippy::needless_pass_by_value)]
    fn at(
        &self,
        py: Python<'_>,
        Point(t, y, u, p): Point,
        evaluate: fn(&dgd_work::Equations, At<'_>) -> Result<Vec<f64>, WorkError>,
    ) -> PyResult<Numbers> {
        let [u, p] = [&u, &p].map(|numbers| numbers.as_ref().map(|one| one.0.as_slice()));
        let point = At { t, y: &y.0, u, p };
        guarded(py, Task::Simulate, || evaluate(&self.inner(), point)).map(Numbers)
    }
}

/// A name and a unit.
fn named(name: &impl ToString, unit: &Unit) -> (String, String) {
    (name.to_string(), unit.symbol.to_string())
}

#[pymethods]
impl Equations {
    #[getter]
    fn unknowns(&self) -> Names {
        let inner = self.inner();
        let unknowns = &inner.signature().unknowns;
        (0..unknowns.len()).map(|i| named(&unknowns.name(i), unknowns.unit(i))).collect()
    }

    #[getter]
    fn inputs(&self) -> Names {
        self.inner().signature().inputs.iter().map(|u| named(&u.name, &u.unit)).collect()
    }

    #[getter]
    fn parameters(&self) -> Names {
        self.inner().signature().parameters.iter().map(|p| named(&p.name, &p.unit)).collect()
    }

    #[getter]
    fn outputs(&self) -> Names {
        self.inner().signature().outputs.iter().map(|w| named(&w.name, &w.unit)).collect()
    }

    #[getter]
    fn times(&self) -> Numbers {
        Numbers(self.inner().times().to_vec())
    }

    #[getter]
    fn mass(&self) -> Numbers {
        Numbers(self.inner().mass().to_vec())
    }

    #[getter]
    fn parameter_values(&self) -> Numbers {
        Numbers(self.inner().parameters())
    }

    fn start(&self, py: Python<'_>) -> PyResult<Numbers> {
        guarded(py, Task::Simulate, || self.inner().start()).map(Numbers)
    }

    fn inputs_at(&self, py: Python<'_>, t: f64) -> PyResult<Numbers> {
        guarded(py, Task::Simulate, || self.inner().inputs(t)).map(Numbers)
    }

    fn rhs(&self, py: Python<'_>, point: Point) -> PyResult<Numbers> {
        self.at(py, point, dgd_work::Equations::rhs)
    }

    fn jacobian(&self, py: Python<'_>, point: Point) -> PyResult<Numbers> {
        self.at(py, point, dgd_work::Equations::jacobian)
    }

    fn parameter_jacobian(&self, py: Python<'_>, point: Point) -> PyResult<Numbers> {
        self.at(py, point, dgd_work::Equations::parameter_jacobian)
    }

    fn outputs_at(&self, py: Python<'_>, point: Point) -> PyResult<Numbers> {
        self.at(py, point, dgd_work::Equations::outputs)
    }
}

/// Residuals of a fit, and their derivatives.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Objective {
    inner: Mutex<dgd_work::Objective>,
}

/// Name, unit, first guess, lower and upper bound, and whether a search should use the logarithm.
type Variable = (String, String, f64, f64, f64, bool);

impl Objective {
    pub(crate) fn new(inner: dgd_work::Objective) -> Self {
        Objective { inner: Mutex::new(inner) }
    }

    /// Evaluates a function without the GIL.
    fn evaluated<T: Send>(
        &self,
        py: Python<'_>,
        theta: &Numbers,
        evaluate: fn(&dgd_work::Objective, &[f64]) -> Result<T, WorkError>,
    ) -> PyResult<T> {
        let ended = py.detach(|| {
            let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            crate::guard::caught(|| evaluate(&inner, &theta.0))
        });
        crate::guard::ended(py, Task::Fit, ended)
    }
}

#[pymethods]
impl Objective {
    #[getter]
    fn variables(&self) -> Vec<Variable> {
        let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let one = |v: &dgd_work::fit::objective::Variable| {
            (v.name.clone(), v.unit.symbol.to_string(), v.value, v.lower, v.upper, v.is_log)
        };
        inner.variables().iter().map(one).collect()
    }

    #[allow(clippy::needless_pass_by_value)]
    fn residuals(&self, py: Python<'_>, theta: Numbers) -> PyResult<Numbers> {
        self.evaluated(py, &theta, dgd_work::Objective::residuals).map(Numbers)
    }

    /// Residuals, and derivatives row by row.
    #[allow(clippy::needless_pass_by_value)]
    fn linearised(&self, py: Python<'_>, theta: Numbers) -> PyResult<(Numbers, Numbers)> {
        let (residuals, rows) = self.evaluated(py, &theta, dgd_work::Objective::linearised)?;
        Ok((Numbers(residuals), Numbers(rows)))
    }
}
