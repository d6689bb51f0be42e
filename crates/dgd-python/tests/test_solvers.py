"""Solvers and optimisers of other packages, on what the model says point by point."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import COOLING, MODEL, Columns, cup

import dgd


def test_scipy_solves_and_fits_what_the_model_says(circulation: Columns) -> None:
    scipy_integrate = pytest.importorskip("scipy.integrate")
    scipy_optimize = pytest.importorskip("scipy.optimize")
    m = dgd.load(MODEL)
    problem = m.problem(circulation)
    solved = scipy_integrate.solve_ivp(
        problem.rhs, (0, 120), problem.y0, "Radau", [60, 120], jac=problem.jacobian, rtol=1e-9, atol=1e-12, max_step=0.5
    )
    run = m.simulate(circulation, until=120.0, rtol=1e-10)
    assert np.allclose(solved.y[0], run["h_r"][[60, 120]], rtol=1e-6)
    o = m.objective(circulation)
    found = scipy_optimize.least_squares(o.residuals, o.x0, o.jacobian, o.bounds, x_scale=np.abs(o.x0))
    f = m.fit(circulation, noise="declared")
    for name, value in f.params.items():
        assert abs(found.x[o.names.index(name)] - value) < 0.01 * f.std[name], name
    scaled = scipy_optimize.approx_fprime(np.ones_like(o.x0), lambda z: o(z * o.x0), 1e-7)
    assert np.allclose(o.gradient(o.x0) * o.x0, scaled, rtol=1e-3, atol=1e-3 * np.abs(scaled).max())


def least_by_pypesto(o: dgd.Objective, method: str, options: dict[str, object]) -> np.ndarray:
    """The optimum of two starts by pyPESTO, of which both have to come there."""
    import pypesto
    from pypesto.optimize import ScipyOptimizer, minimize

    lower, upper = o.bounds
    objective = pypesto.Objective(fun=o, grad=o.gradient, hess=o.hessian, res=o.residuals, sres=o.jacobian)
    guesses = np.array([o.x0, np.clip(1.1 * o.x0, lower, upper)])
    problem = pypesto.Problem(objective, lower, upper, x_names=o.names, x_guesses=guesses)
    optimizer = ScipyOptimizer(method, options=options)
    result = minimize(problem, optimizer, n_starts=2, progress_bar=False)
    first, second = result.optimize_result.fval
    assert second == pytest.approx(first, rel=1e-6)
    return np.asarray(result.optimize_result.x[0])


@pytest.mark.filterwarnings("ignore")
def test_pypesto_ends_where_the_fit_does(circulation: Columns) -> None:
    pytest.importorskip("pypesto")
    # By values, gradients and Hessians: a cup that cools.
    m = dgd.parse(COOLING)
    data = [cup(124, 1), cup(124, 2)]
    o, f = m.objective(data), m.fit(data, noise="declared")
    assert o.names == ["tau", "T(0) of data 1", "T(0) of data 2"]
    x = least_by_pypesto(o, "L-BFGS-B", {"maxiter": 500})
    assert abs(x[0] - f.params["tau"]) < 0.01 * f.std["tau"]
    # By residuals and their derivatives: four parameters and two start values of very different sizes.
    m = dgd.load(MODEL)
    o, f = m.objective([circulation]), m.fit([circulation], noise="declared")
    x = least_by_pypesto(o, "ls_trf", {"x_scale": np.abs(o.x0), "tr_solver": "exact"})
    for name, value in f.params.items():
        assert abs(x[o.names.index(name)] - value) < 0.01 * f.std[name], name
