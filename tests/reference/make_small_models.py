"""References for robertson, van_der_pol, rc_circuit and cstr.

Each comes from `radau.py` and is compared with SciPy on the equations and sensitivity equations
written out by hand.
"""

import numpy as np
import scipy
from mpmath import mp, mpf
from scipy.integrate import solve_ivp
from scipy.special import lambertw

import radau
import table


def augmented(f, f_y, f_p, n):
    """Right-hand side of y and S = dy/dp (row by row) together."""

    def rhs(t, x, *u):
        y, s = x[:n], x[n:].reshape(n, -1)
        return np.r_[f(t, y, *u), (f_y(t, y, *u) @ s + f_p(t, y, *u)).ravel()]

    return rhs


def write(name, what, rows, check, unknowns, parameters, checked_by, problem):
    """Writes rows of t, y, S by rows; `check` has the same columns."""
    difference = table.largest_difference(rows, check)
    comments = [
        *what,
        f"Tool: radau.py (Radau IIA, {problem.stages} stages, {radau.DIGITS} digits, step tolerance"
        f" {mp.nstr(problem.tolerance, 2)} against {problem.stages - 2} stages).",
        f"Check: SciPy {scipy.__version__} {checked_by}; largest difference {difference:.1e} of a column's largest value.",
        "Made by make_small_models.py.",
    ]
    header = ["time [s]", *(f"{y} [{unit}]" for y, unit in unknowns)]
    table.write(name, comments, header + table.sensitivity_header(unknowns, parameters), rows)
    print(f"{name}: differs from the check by {difference:.1e}")


def flat(times, solutions):
    return [[t, *y, *(x for row in s for x in row)] for t, (y, s) in zip(times, solutions)]


def robertson():
    """0.4 * 10^k s, k = 0 .. 11, and 1e11 s."""
    times = [0.0, *(0.4 * 10**k for k in range(12)), 1e11]
    p = [0.04, 3e7, 1e4]

    def f(t, y, u, p):
        first, second, third = p[0] * y[0], p[1] * y[1] ** 2, p[2] * y[1] * y[2]
        return [third - first, first - third - second, second]

    problem = radau.Problem(f, [1, 1, 1], p, [1, 1e-5, 1], "1e-20")
    solutions = radau.simulate(problem, [1, 0, 0], [(t, []) for t in times], first_step="1e-5")

    def f_y(t, y):
        k1, k2, k3 = p
        a = np.array([-k1, k3 * y[2], k3 * y[1]])
        c = np.array([0, 2 * k2 * y[1], 0])
        return np.array([a, -a - c, c])

    def f_p(t, y):
        a, b, c = y[0], y[1] ** 2, y[1] * y[2]
        return np.array([[-a, 0, c], [a, -b, -c], [0, b, 0]])

    rhs = augmented(lambda t, y: np.array(f(t, y, (), p)), f_y, f_p, 3)
    atol = 1e-13 * np.outer([1, 1e-6, 1], [1, *(1 / x for x in p)])
    run = solve_ivp(
        rhs,
        (0, 1e11),
        np.r_[1, 0, 0, np.zeros(9)],
        "Radau",
        times,
        rtol=1e-10,
        atol=np.r_[atol[:, 0], atol[:, 1:].ravel()],
    )
    published = (2.083340149701255e-8, 8.333360770334713e-14, 0.999999979166505)
    off = max(abs(float(y) / x - 1) for y, x in zip(solutions[-1][0], published))
    what = [
        "robertson.dgd, both forms: states and sensitivities.",
        f"At 1e11 s the Test Set for IVP Solvers publishes {published}: largest relative difference {off:.1e}.",
    ]
    unknowns = [("y1", "1"), ("y2", "1"), ("y3", "1")]
    parameters = [("k1", "1/s"), ("k2", "1/s"), ("k3", "1/s")]
    check = np.c_[run.t, run.y.T]
    write(
        "robertson.csv",
        what,
        flat(times, solutions),
        check,
        unknowns,
        parameters,
        "Radau, rtol 1e-10",
        problem,
    )


def van_der_pol():
    """mu = 1000, to 2000 s."""
    times = [200.0 * k for k in range(11)]

    def f(t, y, u, p):
        return [y[1], p[0] * (1 - y[0] ** 2) * y[1] - y[0]]

    def run(mu, stages):
        problem = radau.Problem(f, [1, 1], [mu], [1, 1], "1e-18", stages)
        return problem, radau.simulate(problem, [2, 0], [(t, []) for t in times], first_step="1e-4")

    problem, solutions = run(1000, 9)

    # y once more by SciPy, S by a central difference: its error goes with delta squared.
    delta = mpf("1e-7")
    (_, up), (_, down) = run(1000 + delta, 8), run(1000 - delta, 8)
    differences = [
        [(a - b) / (2 * delta) for a, b in zip(above, below)]
        for (above, _), (below, _) in zip(up, down)
    ]
    states = solve_ivp(
        lambda t, y: f(t, y, (), [1000.0]),
        (0, 2000),
        [2, 0],
        "Radau",
        times,
        rtol=1e-12,
        atol=[1e-14, 1e-17],
    )
    check = [[t, *y, *s] for t, y, s in zip(times, states.y.T, differences)]
    published = (1.706167732170469, -0.8928097010248125e-3)
    off = max(abs(float(y) / x - 1) for y, x in zip(solutions[-1][0], published))
    what = [
        "van_der_pol.dgd, mu = 1000 1/s: states and sensitivities.",
        f"At 2000 s the Test Set for IVP Solvers publishes {published}: largest relative difference {off:.1e}.",
    ]
    unknowns = [("x", "1"), ("v", "1/s")]
    write(
        "van_der_pol.csv",
        what,
        flat(times, solutions),
        check,
        unknowns,
        [("mu", "1/s")],
        "Radau, rtol 1e-12, for y and the difference of two runs of radau.py, mu +- 1e-7, for S",
        problem,
    )


def rc_circuit():
    """A triangle of 5 V and 50 Hz at the source, five half periods."""
    corners = [
        (0.0, 0.0),
        (0.005, 5.0),
        (0.015, -5.0),
        (0.025, 5.0),
        (0.035, -5.0),
        (0.045, 5.0),
        (0.05, 0.0),
    ]
    table.write(
        "rc_circuit_inputs.csv",
        [],
        ["time [s]", "v_s [V]"],
        corners,
    )
    times = [k / 2000 for k in range(101)]
    source = [float(x) for x in np.interp(times, *zip(*corners))]
    p = [10.0, 1e3, 1e-5, 2.5e-9, 0.0453]

    def f(t, y, u, p):
        r_s, r_l, c, i_s, v_t = p
        i = i_s * (mp.exp(y[1] / v_t) - 1)
        return [(i - y[0] / r_l) / c, u[0] - r_s * i - y[1] - y[0]]

    problem = radau.Problem(f, [1, 0], p, [1, 1], "1e-18", stages=8)
    rows = [(t, [v]) for t, v in zip(times, source)]
    solutions = radau.simulate(problem, [0, 0], rows, linear=(0,))

    r_s, r_l, c, i_s, v_t = p

    def diode(v_s, v_c):
        """v_d, and its derivatives to v_c and p, by Lambert's function."""
        w = lambertw(i_s * r_s / v_t * np.exp((v_s - v_c + i_s * r_s) / v_t)).real
        i = v_t / r_s * w - i_s
        slope = (i + i_s) / v_t
        v_d = v_s - v_c - r_s * i
        i_p = np.array([0, 0, 0, i / i_s, -(i + i_s) * v_d / v_t**2])
        v_p = -(r_s * i_p + np.array([i, 0, 0, 0, 0])) / (1 + r_s * slope)
        v_y = -1 / (1 + r_s * slope)
        return i, v_d, v_y, v_p, slope * v_y, slope * v_p + i_p

    def rhs(t, x, inputs):
        i, _, _, _, i_y, i_p = diode(inputs(t), x[0])
        rate = (i - x[0] / r_l) / c
        partial = np.array([0, x[0] / r_l**2 / c, -rate / c, 0, 0]) + i_p / c
        return np.r_[rate, (i_y - 1 / r_l) / c * x[1:] + partial]

    x, check = np.zeros(6), []
    atol = 1e-15 * np.array([1, *(1 / q for q in p)])
    for k, t in enumerate(times):
        if k:
            t0, a, b = times[k - 1], source[k - 1], source[k]

            def line(s, t0=t0, t1=t, a=a, b=b):
                return a + (s - t0) / (t1 - t0) * (b - a)

            x = solve_ivp(rhs, (t0, t), x, "DOP853", args=(line,), rtol=1e-13, atol=atol).y[:, -1]
        _, v_d, v_y, v_p, _, _ = diode(source[k], x[0])
        check.append([t, x[0], v_d, *x[1:], *(v_y * x[1:] + v_p)])
    unknowns = [("v_c", "V"), ("v_d", "V")]
    parameters = [("R_s", "ohm"), ("R_l", "ohm"), ("C", "F"), ("I_s", "A"), ("v_T", "V")]
    what = ["rc_circuit.dgd: unknowns and sensitivities. Inputs: rc_circuit_inputs.csv (linear)."]
    how = "DOP853, rtol 1e-13, v_d eliminated by Lambert's W"
    write("rc_circuit.csv", what, flat(times, solutions), check, unknowns, parameters, how, problem)


def cstr():
    """The coolant rises from 300 K to 305 K at 10 - 12 min: the reactor ignites."""
    inputs = [
        (0.0, 100.0, 26.85),
        (600.0, 100.0, 26.85),
        (720.0, 100.0, 31.85),
        (2400.0, 100.0, 31.85),
    ]
    header = ["time [s]", "q_f [lpm]", "T_c [degC]"]
    table.write("cstr_inputs.csv", [], header, inputs)
    times = [30.0 * k for k in range(81)]
    coolant = [
        float(x) + 273.15 for x in np.interp(times, [r[0] for r in inputs], [r[2] for r in inputs])
    ]
    volume, rho, c_p, c_f, t_f = 0.1, 1000.0, 239.0, 1000.0, 350.0
    p = [7.2e10 / 60, 8750.0, 5e4, 5e4 / 60]

    def balances(y, q, t_c, p, exp):
        k0, e_r, heat, ua = p
        rate = k0 * exp(-e_r / y[1]) * y[0]
        cooling = ua * (t_c - y[1])
        return [
            q * (c_f - y[0]) / volume - rate,
            q * (t_f - y[1]) / volume + (heat * volume * rate + cooling) / (volume * rho * c_p),
        ]

    problem = radau.Problem(
        lambda t, y, u, p: balances(y, u[0], u[1], p, mp.exp), [1, 1], p, [500, 350], "1e-20"
    )
    flow = mpf(1) / 600
    rows = [(t, [flow, t_c]) for t, t_c in zip(times, coolant)]
    solutions = radau.simulate(problem, [877.25, 324.48], rows, linear=(1,))

    k0, e_r, heat, ua = p
    capacity = volume * rho * c_p

    def f_y(t, y, line):
        k = k0 * np.exp(-e_r / y[1])
        rate_y = np.array([k, k * y[0] * e_r / y[1] ** 2])
        out = np.eye(2) / (600 * volume)
        return (
            np.array([-rate_y, heat * volume / capacity * rate_y])
            - out
            - [[0, 0], [0, ua / capacity]]
        )

    def f_p(t, y, line):
        rate = k0 * np.exp(-e_r / y[1]) * y[0]
        rate_p = np.array([rate / k0, -rate / y[1], 0, 0])
        energy = heat * volume * rate_p + np.array([0, 0, volume * rate, line(t) - y[1]])
        return np.array([-rate_p, energy / capacity])

    rhs = augmented(
        lambda t, y, line: np.array(balances(y, 1 / 600, line(t), p, np.exp)), f_y, f_p, 2
    )
    x, check = np.r_[877.25, 324.48, np.zeros(8)], []
    atol = 1e-14 * np.r_[500, 350, (np.outer([500, 350], [1 / q for q in p])).ravel()]
    for k, t in enumerate(times):
        if k:
            t0, a, b = times[k - 1], coolant[k - 1], coolant[k]

            def line(s, t0=t0, t1=t, a=a, b=b):
                return a + (s - t0) / (t1 - t0) * (b - a)

            x = solve_ivp(rhs, (t0, t), x, "DOP853", args=(line,), rtol=1e-13, atol=atol).y[:, -1]
        check.append([t, *x])
    unknowns = [("c", "mol/m^3"), ("T", "K")]
    parameters = [("k0", "1/s"), ("E_R", "K"), ("heat", "J/mol"), ("UA", "W/K")]
    what = ["cstr.dgd: states and sensitivities, T in K. Inputs: cstr_inputs.csv (T_c linear)."]
    write(
        "cstr.csv",
        what,
        flat(times, solutions),
        check,
        unknowns,
        parameters,
        "DOP853, rtol 1e-13",
        problem,
    )


if __name__ == "__main__":
    for make in (robertson, van_der_pol, rc_circuit, cstr):
        make()
