//! Equations at single points, and residuals of fits: for solvers and optimisers of Python.

use std::sync::{Mutex, MutexGuard, PoisonError};

use dgd_runtime::Signature;
use dgd_work::{At, WorkError};
use pyo3::prelude::*;

use crate::errors::Task;
use crate::guard::guarded;
use crate::numbers::Numbers;

/// Names and units.
type Names = Vec<(String, String)>;

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

    fn names(&self, of: impl FnOnce(&Signature) -> Names) -> Names {
        of(self.inner().signature())
    }

    /// Evaluates something at a point.
    fn at(
        &self,
        py: Python<'_>,
        t: f64,
        [y, u, p]: [Option<Numbers>; 3],
        evaluate: fn(&dgd_work::Equations, At<'_>) -> Result<Vec<f64>, WorkError>,
    ) -> PyResult<Numbers> {
        let [y, u, p] = [&y, &u, &p].map(|numbers| numbers.as_ref().map(|one| one.0.as_slice()));
        let at = At { t, y: y.unwrap_or_default(), u, p };
        guarded(py, Task::Simulate, || evaluate(&self.inner(), at)).map(Numbers)
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

    #[pyo3(signature = (t, y, u=None, p=None))]
    fn rhs(
        &self,
        py: Python<'_>,
        t: f64,
        y: Numbers,
        u: Option<Numbers>,
        p: Option<Numbers>,
    ) -> PyResult<Numbers> {
        self.at(py, t, [Some(y), u, p], dgd_work::Equations::rhs)
    }

    #[pyo3(signature = (t, y, u=None, p=None))]
    fn jacobian(
        &self,
        py: Python<'_>,
        t: f64,
        y: Numbers,
        u: Option<Numbers>,
        p: Option<Numbers>,
    ) -> PyResult<Numbers> {
        self.at(py, t, [Some(y), u, p], dgd_work::Equations::jacobian)
    }

    #[pyo3(signature = (t, y, u=None, p=None))]
    fn parameter_jacobian(
        &self,
        py: Python<'_>,
        t: f64,
        y: Numbers,
        u: Option<Numbers>,
        p: Option<Numbers>,
    ) -> PyResult<Numbers> {
        self.at(py, t, [Some(y), u, p], dgd_work::Equations::parameter_jacobian)
    }

    #[pyo3(signature = (t, y, u=None, p=None))]
    fn outputs_at(
        &self,
        py: Python<'_>,
        t: f64,
        y: Numbers,
        u: Option<Numbers>,
        p: Option<Numbers>,
    ) -> PyResult<Numbers> {
        self.at(py, t, [Some(y), u, p], dgd_work::Equations::outputs)
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
