"""The problems, solved with CasADi: its interfaces to CVODES and IDAS, and generated C.

States are scaled by their sizes, as one absolute tolerance is for all. For the recording some steps of
the classical Runge-Kutta method for each sample, mapped over the record and compiled, are far
faster than CVODES inside a map. CasADi does not tell how many steps its integrators take.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

from problems import (AREA, END, FIT_START, FITTED, FLOW, JUMP, NOISE, RANK_START, SIX_NOISE,
                      SIX_START, SIZES, SPEED, TOO_FREE, Request, determined, imbalance,
                      imbalance_six, minimise, nominal, nominal_six, readings)


def model(request):
    """Scaled states, theta and inputs (w, q_out) as symbols; scaled derivatives, and 0 = of P2."""
    values, force = (nominal_six(), imbalance_six) if request.case == "fit6" else (nominal(), imbalance)
    y, theta, u = ca.SX.sym("y", 2), ca.SX.sym("theta", len(values)), ca.SX.sym("u", 2)
    p = [float(value) * theta[i] for i, value in enumerate(values)]
    q = float(SIZES[1]) * y[1]
    balance = force(p, u[0], float(SIZES[0]) * y[0], q)
    ydot = ca.vertcat((q - u[1]) / AREA / SIZES[0], balance / p[0] / SIZES[1])
    return y, theta, u, ydot, balance / float(nominal()[0]) / SIZES[1]


def unscaled(values, sensitivities=None):
    """Rows of h and q, and of the sensitivities, parameter by parameter."""
    rows = np.array(values).T * SIZES
    if sensitivities is not None:
        by_theta = np.array(sensitivities).reshape(2, 5, -1) * SIZES[:, None, None]
        rows = np.hstack([rows, by_theta.transpose(2, 1, 0).reshape(-1, 10)])
    return rows


def jump(request):
    """P1 and P2: two integrators, and their derivatives forward."""
    y, theta, u, ydot, balance = model(request)
    problem = {"x": y, "p": ca.vertcat(theta, u), "ode": ydot}
    if request.case.startswith("p2"):
        problem = {"x": y[0], "z": y[1], "p": ca.vertcat(theta, u), "ode": ydot[0], "alg": balance}
    options = {"reltol": request.rtol, "abstol": 0.01 * request.rtol, "max_num_steps": 100_000}
    chosen, algebraic = ca.MX.sym("theta", 5), "z" in problem
    x, z, parts = ca.MX.ones(1 if algebraic else 2), ca.MX.ones(1), []
    for (begin, end), w in zip(((0, JUMP), (JUMP, END)), SPEED):
        # The first stretch has its start among the outputs.
        times = list(range(begin + (begin > 0), end + 1))
        integrator = ca.integrator("stretch", request.method, problem, begin, times, options)
        start = {"x0": x, "p": ca.vertcat(chosen, w, FLOW)}
        result = integrator(**start, z0=z) if algebraic else integrator(**start)
        parts.append(ca.vertcat(result["xf"], result["zf"]) if algebraic else result["xf"])
        x = result["xf"][:, -1]
        z = result["zf"][:, -1] if algebraic else z
    answer(request, ca.Function("run", [chosen], [ca.horzcat(*parts)]))


def record(request):
    """Rows of the recording as a function of theta, and its steps.

    Equal Runge-Kutta steps in each sample, more of them where tolerances are tighter.
    """
    pieces = 1 if request.rtol >= 1e-4 else 2 if request.rtol >= 1e-6 else 5
    h = 1.0 / pieces
    w, q_out = request.recording()
    y, theta, u, ydot, _ = model(request)
    rhs = ca.Function("rhs", [y, theta, u], [ydot])
    end = y
    for _ in range(pieces):
        k1 = rhs(end, theta, u)
        k2 = rhs(end + h / 2 * k1, theta, u)
        k3 = rhs(end + h / 2 * k2, theta, u)
        k4 = rhs(end + h * k3, theta, u)
        end += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    count, chosen = len(w) - 1, ca.MX.sym("theta", theta.numel())
    steps = ca.Function("step", [y, theta, u], [end]).mapaccum("steps", count)
    inputs = np.vstack([w[:-1], q_out[:-1]])
    rows = steps(ca.MX.ones(2), ca.repmat(chosen, 1, count), inputs)
    return ca.Function("run", [chosen], [ca.horzcat(ca.MX.ones(2), rows)]), pieces * count


def recording(request):
    """P5."""
    function, steps = record(request)
    answer(request, function, compiled, steps)


def weighted(request):
    """Symbols of what is fitted, and errors over their noise."""
    function, _ = record(request)
    if request.case == "fit6":
        free, (w, _) = ca.MX.sym("free", len(SIX_START)), request.recording()
        rows = function(free)
        p = [float(value) * free[i] for i, value in enumerate(nominal_six())]
        h, q = float(SIZES[0]) * rows[0, :], float(SIZES[1]) * rows[1, :]
        modelled = ca.vertcat(*readings(p, ca.DM(w).T, h, q))
        return free, (modelled - request.instruments().T) / ca.DM(SIX_NOISE), SIX_START
    fitted, start = (FITTED, FIT_START) if request.case == "fit" else (TOO_FREE, RANK_START)
    free = ca.MX.sym("free", len(fitted))
    theta = ca.MX.ones(5)
    theta[fitted] = free
    return free, (function(theta) - (request.measured() / SIZES).T) * ca.DM(SIZES / NOISE), start


def fit(request):
    """Levenberg and Marquardt on compiled C, or IPOPT with the Gauss-Newton matrix.

    M, c0 and c2 are fitted, or F, too, of which data determines only a sum with c2, or all and F1.
    """
    free, error, start = weighted(request)
    residuals = ca.Function("residuals", [free], [ca.vec(error)])
    values = residuals(free)
    slopes = residuals.forward(len(start))(free, values, ca.DM.eye(len(start)))
    if request.method == "lm":
        both = compiled(ca.Function("both", [free], [values, slopes]))

        def at(theta):
            values, slopes = both(theta)
            return np.array(values).ravel(), np.array(slopes)

        def lm():
            return found(request, *minimise(at, start), "converged")

        request.measure(lm)
        return
    factor, parameters = ca.MX.sym("factor"), ca.MX.sym("p", 0)
    matrix = ca.triu(factor * ca.mtimes(slopes.T, slopes) / values.numel())
    hessian = ca.Function("hessian", [free, parameters, factor, ca.MX.sym("g", 0)], [matrix])
    # What it reaches otherwise of the weakest of six parameters is three digits.
    tolerance = 1e-12 if request.case == "fit6" else 1e-8
    options = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes",
               "ipopt.tol": tolerance, "hess_lag": hessian}
    problem = {"x": free, "f": ca.dot(values, values) / values.numel() / 2}
    solver = ca.nlpsol("solver", "ipopt", problem, options)

    def run():
        x = np.array(solver(x0=start, lbx=0.1, ubx=10)["x"]).ravel()
        return found(request, x, solver.stats()["iter_count"], solver.stats()["return_status"])

    request.measure(run)


def found(request, theta, steps, status):
    """What a fit answers; where not all it fits is determined, also what it says."""
    if request.case != "rank":
        return theta, steps
    return determined(theta), steps, f"{status}; c2 {theta[2]:.3g}, F {theta[3]:.3g}"


def compiled(function):
    """The function as C of the system's compiler."""
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "run.c", Path(folder) / "run.so"
        # CasADi writes into the working folder only.
        function.generate("run.c", {"with_header": False})
        Path("run.c").rename(source)
        subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", source, "-o", library],
                       check=True)
        return ca.external(function.name(), str(library))


def answer(request, function, build=lambda function: function, steps=0):
    """Measures the function, with its derivatives to theta where they are asked for."""
    theta = np.ones(5)
    if not request.case.endswith("b"):
        run = build(function)
        request.measure(lambda: (run(theta), steps), unscaled)
        return
    chosen = ca.MX.sym("theta", 5)
    values = function(chosen)
    forward = function.forward(5)(chosen, values, ca.DM.eye(5))
    run = build(ca.Function("both", [chosen], [values, forward]))
    request.measure(lambda: (run(theta), steps), lambda both: unscaled(*both))


if __name__ == "__main__":
    asked = Request(sys.argv[1:])
    if asked.case in ("fit", "fit6", "rank"):
        fit(asked)
    elif asked.case.startswith("p5"):
        recording(asked)
    else:
        jump(asked)
