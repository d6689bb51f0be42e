//! Equations at single points, and residuals of fits: for solvers and optimisers in Python.

use std::sync::{Mutex, MutexGuard, PoisonError};

use dgd_runtime::Unit;
use dgd_work::{EquationPoint, WorkError};
use pyo3::prelude::*;

use crate::errors::RequestedTask;
use crate::guard::guarded;
use crate::numbers::PyNumbers;

/// Names and units.
type NamesAndUnits = Vec<(String, String)>;

/// A time in s, unknowns, inputs and parameters; missing ones are those of the recording and of the model.
#[derive(FromPyObject)]
struct PyPoint(f64, PyNumbers, Option<PyNumbers>, Option<PyNumbers>);

/// The equations of a model, evaluated point by point in declared units. Matrices come row by row.
#[pyclass(frozen, name = "Equations", module = "dgd._dgd")]
pub(crate) struct PyEquations {
    inner: Mutex<dgd_work::ModelEquations>,
}

impl PyEquations {
    pub(crate) fn new(inner: dgd_work::ModelEquations) -> Self {
        PyEquations { inner: Mutex::new(inner) }
    }

    fn inner(&self) -> MutexGuard<'_, dgd_work::ModelEquations> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Evaluates a function at a point.
    #[allow(clippy::needless_pass_by_value)]
    fn evaluate(
        &self,
        py: Python<'_>,
        PyPoint(t, y, u, p): PyPoint,
        evaluate: fn(&dgd_work::ModelEquations, EquationPoint<'_>) -> Result<Vec<f64>, WorkError>,
    ) -> PyResult<PyNumbers> {
        let [u, p] = [&u, &p].map(|numbers| numbers.as_ref().map(|one| one.0.as_slice()));
        let point = EquationPoint { t, y: &y.0, u, p };
        guarded(py, RequestedTask::Simulate, || evaluate(&self.inner(), point)).map(PyNumbers)
    }
}

/// A name and a unit.
fn named(name: &impl ToString, unit: &Unit) -> (String, String) {
    (name.to_string(), unit.symbol.to_string())
}

#[pymethods]
impl PyEquations {
    #[getter]
    fn unknowns(&self) -> NamesAndUnits {
        let inner = self.inner();
        let unknowns = &inner.signature().unknowns;
        (0..unknowns.len()).map(|i| named(&unknowns.name(i), unknowns.unit(i))).collect()
    }

    #[getter]
    fn inputs(&self) -> NamesAndUnits {
        self.inner().signature().inputs.iter().map(|u| named(&u.name, &u.unit)).collect()
    }

    #[getter]
    fn parameters(&self) -> NamesAndUnits {
        self.inner().signature().parameters.iter().map(|p| named(&p.name, &p.unit)).collect()
    }

    #[getter]
    fn outputs(&self) -> NamesAndUnits {
        self.inner().signature().outputs.iter().map(|w| named(&w.name, &w.unit)).collect()
    }

    #[getter]
    fn times(&self) -> PyNumbers {
        PyNumbers(self.inner().times().to_vec())
    }

    #[getter]
    fn mass(&self) -> PyNumbers {
        PyNumbers(self.inner().mass().to_vec())
    }

    #[getter]
    fn parameter_values(&self) -> PyNumbers {
        PyNumbers(self.inner().parameters())
    }

    fn start(&self, py: Python<'_>) -> PyResult<PyNumbers> {
        guarded(py, RequestedTask::Simulate, || self.inner().start()).map(PyNumbers)
    }

    fn inputs_at(&self, py: Python<'_>, t: f64) -> PyResult<PyNumbers> {
        guarded(py, RequestedTask::Simulate, || self.inner().inputs(t)).map(PyNumbers)
    }

    fn rhs(&self, py: Python<'_>, point: PyPoint) -> PyResult<PyNumbers> {
        self.evaluate(py, point, dgd_work::ModelEquations::rhs)
    }

    fn jacobian(&self, py: Python<'_>, point: PyPoint) -> PyResult<PyNumbers> {
        self.evaluate(py, point, dgd_work::ModelEquations::jacobian)
    }

    fn parameter_jacobian(&self, py: Python<'_>, point: PyPoint) -> PyResult<PyNumbers> {
        self.evaluate(py, point, dgd_work::ModelEquations::parameter_jacobian)
    }

    fn outputs_at(&self, py: Python<'_>, point: PyPoint) -> PyResult<PyNumbers> {
        self.evaluate(py, point, dgd_work::ModelEquations::outputs)
    }
}

/// Residuals of a fit, and their derivatives.
#[pyclass(frozen, name = "Objective", module = "dgd._dgd")]
pub(crate) struct PyObjective {
    inner: Mutex<dgd_work::Objective>,
}

/// Name, unit, first guess, lower and upper bound, and whether a search should use the logarithm.
type PyVariable = (String, String, f64, f64, f64, bool);

impl PyObjective {
    pub(crate) fn new(inner: dgd_work::Objective) -> Self {
        PyObjective { inner: Mutex::new(inner) }
    }

    /// Evaluates a function without the GIL.
    fn evaluated<T: Send>(
        &self,
        py: Python<'_>,
        theta: &PyNumbers,
        evaluate: fn(&dgd_work::Objective, &[f64]) -> Result<T, WorkError>,
    ) -> PyResult<T> {
        let ended = py.detach(|| {
            let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            crate::guard::caught(|| evaluate(&inner, &theta.0))
        });
        crate::guard::ended(py, RequestedTask::Fit, ended)
    }
}

#[pymethods]
impl PyObjective {
    #[getter]
    fn variables(&self) -> Vec<PyVariable> {
        let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let one = |v: &dgd_work::fit::objective::ObjectiveVariable| {
            (v.name.clone(), v.unit.symbol.to_string(), v.value, v.lower, v.upper, v.is_log)
        };
        inner.variables().iter().map(one).collect()
    }

    #[allow(clippy::needless_pass_by_value)]
    fn residuals(&self, py: Python<'_>, theta: PyNumbers) -> PyResult<PyNumbers> {
        self.evaluated(py, &theta, dgd_work::Objective::residuals).map(PyNumbers)
    }

    /// Residuals, and derivatives row by row.
    #[allow(clippy::needless_pass_by_value)]
    fn linearised(&self, py: Python<'_>, theta: PyNumbers) -> PyResult<(PyNumbers, PyNumbers)> {
        let (residuals, rows) = self.evaluated(py, &theta, dgd_work::Objective::linearised)?;
        Ok((PyNumbers(residuals), PyNumbers(rows)))
    }
}
