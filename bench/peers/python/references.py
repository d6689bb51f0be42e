"""Writes ../data: the recording, and the solutions that errors are taken from.

The model is in problems.py. States are solved together with their sensitivities by SciPy's DOP853 at a
tolerance that only rounding limits; q of the static model is eliminated by hand. How far each differs
from an independent solution by Taylor series is printed.
"""

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from problems import (AREA, END, FIT_START, FITTED, FLOW, JUMP, LEVEL, NOISE, RHO_G, SETS,
                      SIX_NOISE, SIX_START, SPEED, augmented, determined, ensemble, imbalance,
                      minimise, nominal, nominal_six, readings)

DATA = Path(__file__).parent.parent / "data"
P = nominal()
SAMPLES = 6001


def recording():
    """w drifts with noise, one flow jumps between two values, the other is noise; each second."""
    state = 777

    def uniform():
        nonlocal state
        state = (state * 6364136223846793005 + 1442695040888963407) & (2**64 - 1)
        return (state >> 11) / 9007199254740992 * 2 - 1

    samples = np.empty((SAMPLES, 3))
    for k in range(SAMPLES):
        first, second = uniform(), uniform()
        side = 0 if k == 0 else (1, -1)[k // 750 % 2]
        w = 0.8 + 0.04 * np.sin(2 * np.pi * k / 900) + 0.002 * first
        samples[k] = w, 0.03 + 0.004 * side, 0.002 * (1 + 0.1 * second)
    return samples


def stretches(fun, start, **options):
    """From 0 to the jump and on to the end, at whole seconds."""
    rows = [np.asarray(start, dtype=float)[None, :]]
    for (begin, end), w in zip(((0, JUMP), (JUMP, END)), SPEED):
        times = np.arange(begin, end + 1.0)
        solution = solve_ivp(lambda t, y, w=w: fun(y, w), (begin, end), rows[-1][-1], "DOP853",
                             times, rtol=1e-13, max_step=1.0, **options)
        rows.append(solution.y.T[1:])
    return np.concatenate(rows)


def dynamic():
    """P1."""
    atol = np.tile([LEVEL * 1e-15, FLOW * 1e-15], 6)
    start = np.r_[LEVEL, FLOW, np.zeros(10)]
    return stretches(lambda y, w: augmented(y, P, w, FLOW), start, atol=atol)


def balanced_flow(h, w):
    """q(h) of the static model, dq/dh and dq/dtheta."""
    m, c0, c1, c2, f = P
    a, b, c = RHO_G * c2 + f, RHO_G * c1 * w, -RHO_G * (5 - h + c0 * w * w)
    q = (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)
    slope = b + 2 * a * q
    forcing = [0.0, RHO_G * c0 * w * w, -RHO_G * c1 * w * q, -RHO_G * c2 * q * q, -f * q * q]
    return q, -RHO_G / slope, np.array(forcing) / slope


def static():
    """P2; at the jump q is that before it."""

    def fun(y, w):
        q, by_h, by_theta = balanced_flow(y[0], w)
        return np.r_[q - FLOW, by_h * y[1:] + by_theta] / AREA

    levels = stretches(fun, np.r_[LEVEL, np.zeros(5)], atol=LEVEL * 1e-15)
    rows = np.empty((END + 1, 12))
    for k, level in enumerate(levels):
        q, by_h, by_theta = balanced_flow(level[0], SPEED[k > JUMP])
        rows[k, 0::2] = level
        rows[k, 1], rows[k, 3::2] = q, by_h * level[1:] + by_theta
    return rows


def recorded(samples):
    """P5: a problem of its own for each second."""
    rows = np.zeros((SAMPLES, 12))
    rows[0, :2] = LEVEL, FLOW
    atol = np.tile([4e-12, 3.2e-15], 6)
    for k in range(SAMPLES - 1):
        w, q_out = samples[k, 0], samples[k, 1] + samples[k, 2]
        solution = solve_ivp(lambda t, y: augmented(y, P, w, q_out), (0, 1), rows[k], "DOP853",
                             rtol=1e-12, atol=atol, first_step=0.5)
        rows[k + 1] = solution.y[:, -1]
    return rows


def mean_level():
    """P4: the mean of h over all sets and outputs; all sets are one system."""
    p = ensemble(SETS).T

    def fun(y, w):
        h, q = y.reshape(2, -1)
        return np.r_[(q - FLOW) / AREA, imbalance(p, w, h, q) / p[0]]

    total, y = 0.0, np.repeat([LEVEL, FLOW], SETS)
    for (begin, end), w in zip(((0, JUMP), (JUMP, END)), SPEED):
        times = np.arange(begin, end + 1.0)
        solution = solve_ivp(lambda t, y, w=w: fun(y, w), (begin, end), y, "DOP853", times,
                             rtol=1e-11, atol=np.repeat([LEVEL * 1e-12, FLOW * 1e-12], SETS))
        y = solution.y[:, -1]
        total += solution.y[:SETS, 0 if begin == 0 else 1:].sum()
    return np.array([total / SETS / (END + 1)])


def line(cells):
    """P3: p1 at whole seconds, of ../problems/src/line.rs."""
    bulk, area, density, gravity, friction = 1.5e9, 0.0185, 1120.0, 9.81, 3.0e4
    outlet, flow, dx = 3.3e7, 0.03, 3000.0 / cells
    stiffness, inertia = bulk / area / dx, area / density / dx

    def fun(t, y):
        x = min(max((t - 1) / 0.5, 0.0), 1.0)
        inlet = flow * (1 + 0.2 * x**3 * (10 + x * (6 * x - 15)))
        p, q, ydot = y[0::2], y[1::2], np.empty_like(y)
        ydot[0::2] = -stiffness * np.diff(q, prepend=inlet)
        ydot[1::2] = (-inertia * np.diff(p, append=outlet) - friction / density * q * np.abs(q)
                      + area * gravity)
        return ydot

    y = np.empty(2 * cells)
    y[0::2] = outlet + np.arange(cells, 0, -1) * dx * (friction * flow**2 / area - density * gravity)
    y[1::2] = flow
    pressures = [y[0]]
    # The ramp is not analytic at its ends: the solver stops there.
    for begin, end, outputs in ((0, 1, [1]), (1, 1.5, []), (1.5, 20, range(2, 21))):
        solution = solve_ivp(fun, (begin, end), y, "DOP853", [*outputs, *([] if outputs else [end])],
                             rtol=1e-10, atol=np.tile([1e-3, 1e-11], cells))
        y = solution.y[:, -1]
        pressures += [*solution.y[0]] if outputs else []
    return np.array(pressures)


def lines():
    """P3 of all sizes: the larger ones by extrapolation, for their cost grows with the square.

    Differences over a cell are exact to its length: p1 is a series in 1/cells. How far the series
    of lines of up to 2000 cells is from that of 4000 is printed, of the range of p1.
    """
    sizes = np.array([500, 1000, 2000, 4000])
    solved = np.array([line(cells) for cells in sizes])
    solved[1].tofile(DATA / "p3-1000.bin")
    line(100).tofile(DATA / "p3-100.bin")

    def extrapolated(count, cells):
        """Neville's scheme on the first `count` of the solved lines, at 1/cells."""
        values, x = list(solved[:count]), 1 / sizes
        for k in range(1, count):
            values = [((1 / cells - x[i + k]) * values[i] + (x[i] - 1 / cells) * values[i + 1])
                      / (x[i] - x[i + k]) for i in range(count - k)]
        return values[0]

    print("P3", np.abs(extrapolated(3, 4000) - solved[3]).max() / np.ptp(solved[3]))
    for cells in (10_000, 100_000, 1_000_000):
        extrapolated(4, cells).tofile(DATA / f"p3-{cells}.bin")


def taylor(y, p, w, q_out, h, order=24):
    """One step of the augmented system by its Taylor series: products are sums of products.

    p is of five or, with linear friction, of six.
    """
    c = np.zeros((order + 1, len(y)))
    c[0] = y
    m, c0, c1, c2, f, linear = np.append(p, 0.0)[:6]
    a, b = RHO_G * c2 + f, RHO_G * c1 * w + linear
    for n in range(order):
        q, i = c[: n + 1, 1], n == 0
        square = q @ q[::-1]
        qdot = (RHO_G * ((5 + c0 * w * w) * i - c[n, 0]) - b * q[n] - a * square) / m
        c[n + 1, 0], c[n + 1, 1] = (q[n] - q_out * i) / AREA, qdot
        forcing = [-qdot, RHO_G * c0 * w * w / m * i, -RHO_G * c1 * w / m * q[n],
                   -RHO_G * c2 / m * square, -f / m * square, -linear / m * q[n]]
        for j in range(len(p)):
            s = c[: n + 1, 3 + 2 * j]
            c[n + 1, 2 + 2 * j] = s[n] / AREA
            c[n + 1, 3 + 2 * j] = (-RHO_G * c[n, 2 + 2 * j] - b * s[n]
                                   - 2 * a * (q @ s[::-1])) / m + forcing[j]
        c[n + 1] /= n + 1
    return np.polyval(c[::-1], h)


def difference(rows, inputs):
    """The largest difference from the Taylor series, of a column's largest value."""
    y, worst, largest = rows[0].copy(), np.zeros(12), np.abs(rows).max(0)
    for k, (w, q_out) in enumerate(inputs):
        y = taylor(y, P, w, q_out, 1.0)
        worst = np.maximum(worst, np.abs(y - rows[k + 1]))
    return (worst / largest).max()


def by_series(samples, p):
    """States and sensitivities to theta at the samples, by Taylor series."""
    rows = np.zeros((SAMPLES, 2 + 2 * len(p)))
    rows[0, :2] = LEVEL, FLOW
    for k, (w, q_b, q_tf) in enumerate(samples[:-1]):
        rows[k + 1] = taylor(rows[k], p, w, q_b + q_tf, 1.0, order=14)
    return rows


def fitted(samples, measured):
    """theta that explains the measurements best."""

    def residuals(theta):
        p = P.copy()
        p[FITTED] *= theta
        rows = by_series(samples, p)
        slopes = [rows[:, 2 + 2 * j:4 + 2 * j] / NOISE for j in FITTED]
        # What they are sensitivities to is the parameter over its value, not over its nominal one.
        jacobian = np.stack([s.ravel() / x for s, x in zip(slopes, theta)], axis=1)
        return ((rows[:, :2] - measured) / NOISE).ravel(), jacobian

    return minimise(residuals, FIT_START)[0]


def fitted_six(samples, measured):
    """The same for all six parameters and four instruments."""

    def residuals(theta):
        p, w = nominal_six() * theta, samples[:, 0]
        rows = by_series(samples, p)
        h, q = rows[:, 0], rows[:, 1]
        columns = []
        for j in range(6):
            by_h, by_q = rows[:, 2 + 2 * j], rows[:, 3 + 2 * j]
            by_head = -(p[2] * w + 2 * p[3] * q) * by_q
            by_head += {1: p[1] * w * w, 2: -p[2] * w * q, 3: -p[3] * q * q}.get(j, 0.0)
            slopes = [by_h, by_q, -RHO_G * by_h, RHO_G * (by_head - by_h)]
            columns.append((np.stack(slopes, axis=1) / SIX_NOISE).ravel() / theta[j])
        modelled = np.stack(readings(p, w, h, q), axis=1)
        return ((modelled - measured) / SIX_NOISE).ravel(), np.stack(columns, axis=1)

    return minimise(residuals, SIX_START)[0]


def instruments(samples):
    """What four instruments show of the model with linear friction, with noise."""
    p = nominal_six()
    rows = by_series(samples, p)
    shown = np.stack(readings(p, samples[:, 0], rows[:, 0], rows[:, 1]), axis=1)
    return shown + np.random.default_rng(778).standard_normal(shown.shape) * SIX_NOISE


def main():
    """Writes all files."""
    DATA.mkdir(exist_ok=True)
    samples = recording()
    samples.tofile(DATA / "recording.bin")
    rows = dynamic()
    rows.tofile(DATA / "p1.bin")
    print("P1", difference(rows, [(SPEED[k >= JUMP], FLOW) for k in range(END)]))
    static().tofile(DATA / "p2.bin")
    rows = recorded(samples)
    rows.tofile(DATA / "p5.bin")
    print("P5", difference(rows, [(s[0], s[1] + s[2]) for s in samples[:-1]]))
    noise = np.random.default_rng(777).standard_normal((SAMPLES, 2)) * NOISE
    measured = rows[:, :2] + noise
    measured.tofile(DATA / "measured.bin")
    theta = fitted(samples, measured)
    theta.tofile(DATA / "fit.bin")
    # With F free the minimum is a line, and where the line is known to be is the same.
    determined(np.append(theta, 1.0)).tofile(DATA / "rank.bin")
    shown = instruments(samples)
    shown.tofile(DATA / "instruments.bin")
    fitted_six(samples, shown).tofile(DATA / "fit6.bin")
    mean_level().tofile(DATA / "p4.bin")
    lines()


if __name__ == "__main__":
    main()
