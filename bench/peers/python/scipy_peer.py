"""The problems, solved with SciPy: a call of solve_ivp for each stretch of constant inputs.

The sensitivity equations are written by hand, as SciPy has none.
"""

import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from problems import (AREA, END, FIT_START, FITTED, FLOW, JUMP, LEVEL, NOISE, RANK_START, RHO_G,
                      SIX_NOISE, SIX_START, SPEED, TOO_FREE, Request, augmented, determined,
                      imbalance, imbalance_six, nominal, nominal_six, readings)

P = tuple(map(float, nominal()))


def states(t, y, w, q_out):
    """d/dt of h and q."""
    return [(y[1] - q_out) / AREA, imbalance(P, w, y[0], y[1]) / P[0]]


def slopes(t, y, w, q_out):
    """The Jacobian."""
    m, _, c1, c2, f = P
    by_q = (-RHO_G * c1 * w - 2 * (RHO_G * c2 + f) * y[1]) / m
    return [[0.0, 1 / AREA], [-RHO_G / m, by_q]]


def both(t, y, w, q_out):
    """d/dt of states and sensitivities."""
    return augmented(y, P, w, q_out)


def start(request):
    """h and q, and sensitivities where they are asked for."""
    return np.array([LEVEL, FLOW, *([0.0] * (10 if request.case.endswith("b") else 0))])


def options(request, y):
    """Tolerances, and the Jacobian where the method takes one and it is cheap to write."""
    chosen = {"method": request.method, "rtol": request.rtol, "atol": request.atol(len(y))}
    if request.method == "LSODA" and len(y) == 2:
        chosen["jac"] = slopes
    return chosen


def jump(request):
    """P1."""
    y = start(request)
    fun, chosen = states if len(y) == 2 else both, options(request, y)

    def run():
        rows, evaluations = [y[None, :]], 0
        for (begin, end), w in zip(((0, JUMP), (JUMP, END)), SPEED):
            solution = solve_ivp(fun, (begin, end), rows[-1][-1], args=(w, FLOW),
                                 t_eval=np.arange(begin + 1.0, end + 1), **chosen)
            rows.append(solution.y.T)
            evaluations += solution.nfev
        return np.concatenate(rows), evaluations

    request.measure(run)


def recording(request):
    """P5: the first step that is tried is nearly all of a second."""
    y, (w, q_out) = start(request), request.recording()
    fun, chosen = states if len(y) == 2 else both, options(request, y)
    rows = np.empty((len(w), len(y)))

    def run():
        rows[0], evaluations = y, 0
        for k in range(len(w) - 1):
            solution = solve_ivp(fun, (k, k + 1), rows[k], args=(w[k], q_out[k]), t_eval=[k + 1],
                                 first_step=0.999999, **chosen)
            rows[k + 1] = solution.y[:, -1]
            evaluations += solution.nfev
        return rows, evaluations

    request.measure(run)


def simulated(request, recording, force, p):
    """h and q at each second."""
    (w, q_out), atol, p = recording, request.atol(2), tuple(map(float, p))

    def fun(t, y, w, q_out):
        return [(y[1] - q_out) / AREA, force(p, w, y[0], y[1]) / p[0]]

    rows = np.empty((len(w), 2))
    rows[0] = LEVEL, FLOW
    for k in range(len(w) - 1):
        rows[k + 1] = solve_ivp(fun, (k, k + 1), rows[k], "RK45", t_eval=[k + 1],
                                args=(w[k], q_out[k]), rtol=request.rtol, atol=atol,
                                first_step=0.999999).y[:, -1]
    return rows


def fit(request):
    """M, c0 and c2, in `rank` F, too, in `fit6` all, by least_squares with differences for derivatives."""
    recording = request.recording()
    if request.case == "fit6":
        start, measured = SIX_START, request.instruments()
    else:
        fitted, start = (FITTED, FIT_START) if request.case == "fit" else (TOO_FREE, RANK_START)
        measured = request.measured()

    def residuals(theta):
        if request.case == "fit6":
            p = nominal_six() * theta
            h, q = simulated(request, recording, imbalance_six, p).T
            shown = np.stack(readings(p, recording[0], h, q), axis=1)
            return ((shown - measured) / SIX_NOISE).ravel()
        p = nominal()
        p[fitted] *= theta
        return ((simulated(request, recording, imbalance, p) - measured) / NOISE).ravel()

    def run():
        # Differences must stand out from the errors of the simulations; without bounds a trial
        # leaves the parameters that can be simulated.
        found = least_squares(residuals, start, bounds=(0.1, 10), method=request.method,
                              diff_step=1e-4)
        if request.case != "rank":
            return found.x, found.nfev
        says = f"{found.message}; c2 {found.x[2]:.3g}, F {found.x[3]:.3g}"
        return determined(found.x), found.nfev, says

    request.measure(run)


if __name__ == "__main__":
    asked = Request(sys.argv[1:])
    {"p1a": jump, "p1b": jump, "p5a": recording, "p5b": recording,
     "fit": fit, "fit6": fit, "rank": fit}[asked.case](asked)
