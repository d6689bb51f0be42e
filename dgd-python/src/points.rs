//! Equations at single points, and residuals of fits: for solvers and optimisers of Python.

use std::sync::{Mutex, MutexGuard, PoisonError};

use dgd_runtime::Signature;
use dgd_work::{At, WorkError};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::errors::Task;
use crate::guard::guarded;

/// A list of numbers from Python.
type Numbers<'py> = PyReadonlyArray1<'py, f64>;
/// A list of numbers for Python.
type Array<'py> = Bound<'py, PyArray1<f64>>;
/// Names and units.
type Names = Vec<(String, String)>;

/// The equations of a model, evaluated point by point in declared units. Matrices come row by row.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Equations {
    inner: Mutex<dgd_work::Equations>,
}

fn slice(numbers: &Numbers<'_>) -> Vec<f64> {
    numbers.as_array().to_vec()
}

impl Equations {
    pub(crate) fn new(inner: dgd_work::Equations) -> Self {
        Equations { inner: Mutex::new(inner) }
    }

    fn inner(&self) -> MutexGuard<'_, dgd_work::Equations> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn names(&self, of: impl FnOnce(&Signature) -> Names) -> Names {
        of(self.inner().signature())
    }

    /// Evaluates something at a point.
    fn at<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        y: &Numbers<'_>,
        u: Option<&Numbers<'_>>,
        p: Option<&Numbers<'_>>,
        evaluate: fn(&dgd_work::Equations, At<'_>) -> Result<Vec<f64>, WorkError>,
    ) -> PyResult<Array<'py>> {
        let (y, u, p) = (slice(y), u.map(slice), p.map(slice));
        let at = At { t, y: &y, u: u.as_deref(), p: p.as_deref() };
        let found = guarded(py, Task::Simulate, || evaluate(&self.inner(), at))?;
        Ok(found.into_pyarray(py))
    }
}

#[pymethods]
impl Equations {
    #[getter]
    fn unknowns(&self) -> Names {
        self.names(|signature| {
            let one = |i| {
                let unit = &signature.unknowns.unit(i).symbol;
                (signature.unknowns.name(i).to_string(), unit.to_string())
            };
            (0..signature.unknowns.len()).map(one).collect()
        })
    }

    #[getter]
    fn inputs(&self) -> Names {
        self.names(|signature| {
            let inputs = signature.inputs.iter();
            inputs.map(|u| (u.name.to_string(), u.unit.symbol.to_string())).collect()
        })
    }

    #[getter]
    fn parameters(&self) -> Names {
        self.names(|signature| {
            let parameters = signature.parameters.iter();
            parameters.map(|p| (p.name.to_string(), p.unit.symbol.to_string())).collect()
        })
    }

    #[getter]
    fn outputs(&self) -> Names {
        self.names(|signature| {
            let outputs = signature.outputs.iter();
            outputs.map(|w| (w.name.to_string(), w.unit.symbol.to_string())).collect()
        })
    }

    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner().times().to_vec().into_pyarray(py)
    }

    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner().mass().to_vec().into_pyarray(py)
    }

    #[getter]
    fn parameter_values<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner().parameters().into_pyarray(py)
    }

    fn start<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        Ok(guarded(py, Task::Simulate, || self.inner().start())?.into_pyarray(py))
    }

    fn inputs_at<'py>(&self, py: Python<'py>, t: f64) -> PyResult<Array<'py>> {
        Ok(guarded(py, Task::Simulate, || self.inner().inputs(t))?.into_pyarray(py))
    }

    #[pyo3(signature = (t, y, u=None, p=None))]
    #[allow(clippy::needless_pass_by_value)]
    fn rhs<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        y: Numbers<'py>,
        u: Option<Numbers<'py>>,
        p: Option<Numbers<'py>>,
    ) -> PyResult<Array<'py>> {
        self.at(py, t, &y, u.as_ref(), p.as_ref(), dgd_work::Equations::rhs)
    }

    #[pyo3(signature = (t, y, u=None, p=None))]
    #[allow(clippy::needless_pass_by_value)]
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        y: Numbers<'py>,
        u: Option<Numbers<'py>>,
        p: Option<Numbers<'py>>,
    ) -> PyResult<Array<'py>> {
        self.at(py, t, &y, u.as_ref(), p.as_ref(), dgd_work::Equations::jacobian)
    }

    #[pyo3(signature = (t, y, u=None, p=None))]
    #[allow(clippy::needless_pass_by_value)]
    fn parameter_jacobian<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        y: Numbers<'py>,
        u: Option<Numbers<'py>>,
        p: Option<Numbers<'py>>,
    ) -> PyResult<Array<'py>> {
        self.at(py, t, &y, u.as_ref(), p.as_ref(), dgd_work::Equations::parameter_jacobian)
    }

    #[pyo3(signature = (t, y, u=None, p=None))]
    #[allow(clippy::needless_pass_by_value)]
    fn outputs_at<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        y: Numbers<'py>,
        u: Option<Numbers<'py>>,
        p: Option<Numbers<'py>>,
    ) -> PyResult<Array<'py>> {
        self.at(py, t, &y, u.as_ref(), p.as_ref(), dgd_work::Equations::outputs)
    }
}

/// Residuals of a fit, and their derivatives.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Objective {
    inner: Mutex<dgd_work::Objective>,
}

/// Name, unit, first guess, lower and upper bound, and whether the logarithm is better searched for.
type Variable = (String, String, f64, f64, f64, bool);

impl Objective {
    pub(crate) fn new(inner: dgd_work::Objective) -> Self {
        Objective { inner: Mutex::new(inner) }
    }

    /// Evaluates something without the interpreter's lock.
    fn evaluated<T: Send>(
        &self,
        py: Python<'_>,
        theta: &Numbers<'_>,
        evaluate: fn(&dgd_work::Objective, &[f64]) -> Result<T, WorkError>,
    ) -> PyResult<T> {
        let theta = slice(theta);
        let ended = py.detach(|| {
            let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            crate::guard::caught(|| evaluate(&inner, &theta))
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
    fn residuals<'py>(&self, py: Python<'py>, theta: Numbers<'py>) -> PyResult<Array<'py>> {
        let found = self.evaluated(py, &theta, dgd_work::Objective::residuals)?;
        Ok(found.into_pyarray(py))
    }

    /// Residuals, and derivatives row by row.
    #[allow(clippy::needless_pass_by_value)]
    fn linearised<'py>(
        &self,
        py: Python<'py>,
        theta: Numbers<'py>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let (residuals, rows) = self.evaluated(py, &theta, dgd_work::Objective::linearised)?;
        Ok((residuals.into_pyarray(py), rows.into_pyarray(py)))
    }
}
