"""Right-hand sides, Jacobians and residuals: against differences, and against dgd's own runs."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from conftest import MODEL, Columns

import dgd

INPUTS = {"w_ssp": 52.0, "q_boost": 1800.0, "q_tf": 290.0}
Y = np.array([51.0, 0.033])


def test_the_right_hand_side_is_the_models_own() -> None:
    m = dgd.load(MODEL)
    assert m.unknowns == {"h_r": "m", "q_ssp": "m^3/s"}
    f = m.rhs(0.0, Y, INPUTS, {"c0": 281.0})
    # The page of the thesis, written down again.
    rho, g, area = 1120.0, 9.81, np.pi / 4 * (19.75 * 0.0254) ** 2
    h, q, w = 51.0, 0.033, 0.52
    head = rho * g * (281.0 * w**2 - 9.0e3 * q * abs(q))
    net = rho * g * (307 - h) + head - 1.75e8 * q * abs(q) - rho * g * 302
    assert f[0] == pytest.approx((q - 2090 / 60000) / area, rel=1e-12)
    assert f[1] == pytest.approx(net / 1.1e8, rel=1e-9)
    with pytest.raises(dgd.UsageError, match='inputs={"w_ssp"'):
        m.rhs(0.0, Y)
    with pytest.raises(dgd.UsageError, match="there is no value of `q_boost`"):
        m.rhs(0.0, Y, {"w_ssp": 52.0})
    with pytest.raises(dgd.UsageError, match="there is no `c9`"):
        m.rhs(0.0, Y, INPUTS, {"c9": 1.0})
    with pytest.raises(dgd.UsageError, match="2 unknowns, and 3"):
        m.rhs(0.0, np.zeros(3), INPUTS)


def test_jacobians_are_those_of_differences(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    problem = m.problem(circulation)
    assert problem.names == ["h_r", "q_ssp"] and problem.span == (0.0, 3600.0) and problem.mass.tolist() == [1, 1]
    assert problem.inputs(0.0) == pytest.approx({"w_ssp": 52.76, "q_boost": 1850.0, "q_tf": 290.0})
    for jacobian, rhs in (
        (problem.jacobian(700.0, Y), lambda y: problem.rhs(700.0, y)),
        (m.jacobian(0.0, Y, INPUTS), lambda y: m.rhs(0.0, y, INPUTS)),
    ):
        steps = 1e-4 * np.diag(Y)
        columns = [(rhs(Y + step) - rhs(Y - step)) / (2 * step.sum()) for step in steps]
        assert np.allclose(jacobian, np.array(columns).T, rtol=1e-6, atol=1e-9)
        assert np.abs(jacobian).max() > 0
    assert problem.parameter_jacobian(700.0, Y).shape == (2, 6)
    assert problem.outputs(0.0, problem.y0)["p_r"] == pytest.approx(m.simulate(circulation, until=1)["p_r"][0])
    with pytest.raises(dgd.DataError):
        problem.rhs(1e9, Y)


def test_a_step_by_hand_is_where_a_run_goes(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    problem = m.problem(circulation, params={"c0": 280.0})
    run = m.simulate(circulation, params={"c0": 280.0}, until=60.0, every=0.5, rtol=1e-10)
    y, h = problem.y0, 0.05
    # Runge and Kutta's method of order four, in steps that hit the jumps of the inputs.
    for k in range(round(60 / h)):
        t = k * h
        a = problem.rhs(t, y)
        b = problem.rhs(t + h / 2, y + h / 2 * a)
        c = problem.rhs(t + h / 2, y + h / 2 * b)
        d = problem.rhs(t + h * (1 - 1e-12), y + h * c)
        y = y + h / 6 * (a + 2 * b + 2 * c + d)
    assert y[0] == pytest.approx(run["h_r"][-1], rel=1e-8)


def test_residuals_and_their_derivatives(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    short = {name: values[:601] for name, values in circulation.items()}
    o = m.objective([short], rtol=1e-9)
    assert o.names == ["M_ssp", "c0", "c2", "F2", "h_r(0)", "q_ssp(0)"] and o.logarithmic == ["M_ssp"]
    assert o.x0[1] == 275.0 and o.x0[4] == 50.0 and o.bounds[0][1] == 0 and np.isinf(o.bounds[1][1])
    residuals, jacobian = o.residuals(o.x0), o.jacobian(o.x0)
    assert residuals.shape == (4 * 601,) and jacobian.shape == (4 * 601, 6)
    r = m.simulate(short, rtol=1e-9)
    assert np.allclose(residuals[:601], (r["p_r"] - short["p_r [bara]"]) / 0.01, rtol=1e-9)
    for j, x in enumerate(o.x0):
        step = np.zeros(6)
        step[j] = 1e-4 * x
        difference = (o.residuals(o.x0 + step) - o.residuals(o.x0 - step)) / (2 * step[j])
        assert np.allclose(jacobian[:, j], difference, rtol=0, atol=1e-4 * np.abs(difference).max()), o.names[j]
    assert o(o.x0) == pytest.approx(0.5 * residuals @ residuals)
    assert np.allclose(o.gradient(o.x0), jacobian.T @ residuals) and np.allclose(o.hessian(o.x0), jacobian.T @ jacobian)


def test_gauss_and_newton_come_to_the_fit(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    f = m.fit(circulation, noise="declared")
    o = m.objective(circulation)
    x = o.x0
    for _ in range(12):
        scale = np.abs(o.x0)
        jacobian = o.jacobian(x) * scale
        x = x - scale * np.linalg.lstsq(jacobian, o.residuals(x), rcond=None)[0]
    for name, value in f.params.items():
        assert abs(x[o.names.index(name)] - value) < 0.01 * f.std[name], name
    with pytest.raises(dgd.FitError, match="data: "):
        o.residuals(np.where(np.array(o.names) == "M_ssp", np.nan, x))


def test_what_is_minimised_can_be_copied_and_pickled(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    short = {name: values[:121] for name, values in circulation.items()}
    o = m.objective([short], free="c0", noise={"p_r": 0.02}, rtol=1e-8)
    assert copy.copy(o) is o and copy.deepcopy([o])[0] is o
    again = pickle.loads(pickle.dumps(o))
    assert again.names == o.names and np.array_equal(again.residuals(o.x0), o.residuals(o.x0))
    problem = m.problem(short, params={"c0": 280})
    again = pickle.loads(pickle.dumps(problem))
    assert np.array_equal(again.rhs(3.0, Y), problem.rhs(3.0, Y)) and copy.deepcopy(problem) is problem
