"""The problems' equations in NumPy, and how a Python program answers the driver.

What is asked and answered is in ../problems/src/request.rs, the model in ../problems/src/two_state.rs.
"""

import sys
import time
from pathlib import Path

import numpy as np

RHO_G, AREA, FLOW, LEVEL = 1120.0 * 9.81, 0.1976, 0.032, 40.0
SIZES = np.array([LEVEL, FLOW])
SPEED = (0.8, 0.88)
JUMP, END = 100, 1000
SETS = 10_000
NOISE = np.array([0.05, 2e-4])
# Which parameters are fitted, M, c0 and c2, and by what factor they start off.
FITTED, FIT_START = [0, 1, 3], np.array([1.3, 0.7, 1.3])
# The same with F, of which data determines only a sum with c2.
TOO_FREE, RANK_START = [0, 1, 3, 4], np.array([1.3, 0.7, 1.3, 0.7])
# Of fit6, which fits all parameters, F1 too, to h, q and the pressures before and behind the pump.
LINEAR_FRICTION, DEPTH = 2e6, 307.0
SIX_START, SIX_NOISE = np.array([1.3, 0.7, 1.3, 0.7, 1.3, 0.7]), np.array([0.05, 2e-4, 1e3, 1e3])


def nominal():
    """M, c0, c1, c2, F; steady at w = 0.8."""
    c1, c2, f, w = 500.0, 2e4, 3e8, SPEED[0]
    losses = f * FLOW**2 / RHO_G + c1 * w * FLOW + c2 * FLOW**2
    return np.array([1.1e8, (LEVEL - 5 + losses) / w**2, c1, c2, f])


def nominal_six():
    """M, c0, c1, c2, F, F1."""
    return np.append(nominal(), LINEAR_FRICTION)


def ensemble(count):
    """The first `count` parameter sets of P4."""
    state, sets = 12345, np.empty((count, 5))
    for i in range(count):
        for j in range(5):
            state = (state * 6364136223846793005 + 1442695040888963407) & (2**64 - 1)
            sets[i, j] = 1 + 0.1 * ((state >> 11) / 9007199254740992 * 2 - 1)
    return nominal() * sets


def imbalance(p, w, h, q):
    """Pressure that accelerates the flow."""
    return RHO_G * (5 - h + p[1] * w * w - p[2] * w * q - p[3] * q * q) - p[4] * q * q


def imbalance_six(p, w, h, q):
    """The same with friction that is linear, too."""
    return imbalance(p[:5], w, h, q) - p[5] * q


def readings(p, w, h, q):
    """What four instruments show: h, q, and the pressures before and behind the pump."""
    inlet = RHO_G * (DEPTH - h)
    return h, q, inlet, inlet + RHO_G * (p[1] * w * w - p[2] * w * q - p[3] * q * q)


def augmented(y, p, w, q_out):
    """d/dt of h, q and their sensitivities to theta = p/p_nominal, parameter by parameter."""
    h, q = y[0], y[1]
    m, c0, c1, c2, f = p
    qdot = imbalance(p, w, h, q) / m
    by_h, by_q = -RHO_G / m, (-RHO_G * c1 * w - 2 * (RHO_G * c2 + f) * q) / m
    return [
        (q - q_out) / AREA,
        qdot,
        y[3] / AREA,
        by_h * y[2] + by_q * y[3] - qdot,
        y[5] / AREA,
        by_h * y[4] + by_q * y[5] + RHO_G * c0 * w * w / m,
        y[7] / AREA,
        by_h * y[6] + by_q * y[7] - RHO_G * c1 * w * q / m,
        y[9] / AREA,
        by_h * y[8] + by_q * y[9] - RHO_G * c2 * q * q / m,
        y[11] / AREA,
        by_h * y[10] + by_q * y[11] - f * q * q / m,
    ]


def minimise(residuals, theta, most=30):
    """Levenberg and Marquardt; `residuals` gives them with their Jacobian, in one run."""
    (e, jacobian), damping, runs = residuals(theta), 1e-4, 1
    while runs < most:
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ e
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
        trial, slopes = residuals(theta - step)
        runs += 1
        gain = e @ e - trial @ trial
        if not gain >= 0:
            damping *= 3
            continue
        theta, e, jacobian, damping = theta - step, trial, slopes, damping / 10
        if gain < 1e-9 * (e @ e):
            return theta, runs
    raise ArithmeticError("no minimum in sight")


def determined(theta):
    """M, c0, and the one number of c2 and F that acts; theta has all four."""
    _, _, _, c2, f = nominal()
    losses = RHO_G * c2 * theta[2] + f * theta[3]
    return np.array([theta[0], theta[1], losses / (RHO_G * c2 + f)])


class Request:
    """What the driver asks."""

    def __init__(self, arguments):
        if len(arguments) != 6:
            sys.exit("usage: CASE METHOD RTOL SPAN DATA OUTPUT")
        self.case, self.method = arguments[:2]
        self.rtol, self.span = float(arguments[2]), float(arguments[3])
        self.data, self.output = Path(arguments[4]), Path(arguments[5])

    def atol(self, states):
        """A hundredth of rtol, of the sizes; for `states` numbers."""
        return np.tile(0.01 * self.rtol * SIZES, states // 2)

    def recording(self):
        """w and the flow out of the volume, at each second."""
        samples = np.fromfile(self.data / "recording.bin").reshape(-1, 3)
        return samples[:, 0], samples[:, 1] + samples[:, 2]

    def measured(self):
        """h and q with noise, at each second of the recording."""
        return np.fromfile(self.data / "measured.bin").reshape(-1, 2)

    def instruments(self):
        """What four instruments showed, with noise, at each second of the recording."""
        return np.fromfile(self.data / "instruments.bin").reshape(-1, 4)

    def measure(self, run, finish=lambda values: values):
        """Repeats `run`, which gives values, steps and what is said, until the span is over.

        What `finish` makes of the values is written, and not timed.
        """
        times, begin = [], time.perf_counter()
        while not times or time.perf_counter() - begin < self.span:
            start = time.perf_counter()
            values, steps, *says = run()
            times.append(time.perf_counter() - start)
        np.ascontiguousarray(finish(values), dtype="<f8").tofile(self.output)
        print(f"least {min(times):e}\nmedian {np.median(times):e}\nsteps {steps}")
        if says:
            print(f"says {says[0]}")
