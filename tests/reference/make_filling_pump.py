"""Reference for `models/filling_pump.dgd`: SciPy's interpolants, and its DOP853 from knot to knot.

PchipInterpolator has the slopes of Fritsch and Butland, CubicSpline natural ends. Sensitivities are those of the
variational equations, integrated along. Run with numpy and scipy; it takes a few seconds.
"""

import numpy as np
import scipy
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator

import table

HOUR = 3600.0
G, RHO, H_PIPE, L_A, K = 9.81, 998.0, 12.0, 2.5e4, 900.0
FLOWS = np.array([0, 100, 200, 300, 400]) / HOUR
head = PchipInterpolator(FLOWS, [32, 31.2, 28.6, 23.9, 16.8])
eta = CubicSpline(FLOWS, [0, 0.48, 0.71, 0.74, 0.58], bc_type="natural")
LEVELS, AREAS = np.array([0, 0.8, 2, 3.5, 5]), np.array([18.0, 41, 46, 47, 38])
head_slope = head.derivative()

# Time, speed (lines between), flow to the town (held).
INPUTS = [(0, 0.95, 150), (1200, 1.0, 150), (2400, 1.0, 400), (5400, 0.94, 250), (7200, 0.98, 250)]


def inputs(t, segment):
    (t0, w0, out), (t1, w1, _) = INPUTS[segment], INPUTS[segment + 1]
    return w0 + (w1 - w0) * (t - t0) / (t1 - t0), out / HOUR


def area(h, piece):
    slope = (AREAS[piece + 1] - AREAS[piece]) / (LEVELS[piece + 1] - LEVELS[piece])
    return AREAS[piece] + slope * (h - LEVELS[piece]), slope


def total_head(q, w):
    return w * w * head(q / w)


def power(q, w):
    return RHO * G * q * total_head(q, w) / eta(q / w)


def slopes(t, y, segment, piece):
    h, q, h_k, q_k = y
    w, q_out = inputs(t, segment)
    a, da = area(h, piece)
    dh = (q - q_out) / a
    dq = G / L_A * (total_head(q, w) - H_PIPE - h - K * q * abs(q))
    rows = np.array([[-dh * da / a, 1 / a], [-G / L_A, G / L_A * (w * head_slope(q / w) - 2 * K * abs(q))]])
    to_k = rows @ [h_k, q_k] + [0, -G / L_A * q * abs(q)]
    return [dh, dq, *to_k]


def run(times):
    y, t = np.array([0.5, 300 / HOUR, 0, 0]), 0.0
    rows = {0.0: y}
    for segment in range(len(INPUTS) - 1):
        end = INPUTS[segment + 1][0]
        while t < end:
            piece = int(np.searchsorted(LEVELS, y[0], side="right")) - 1
            if y[0] == LEVELS[piece] and slopes(t, y, segment, piece)[0] < 0:
                piece -= 1

            def leaves(knot, direction):
                def event(t, y):
                    return y[0] - knot

                event.terminal, event.direction = True, direction
                return event

            solution = solve_ivp(
                lambda t, y: slopes(t, y, segment, piece),
                (t, end),
                y,
                method="DOP853",
                rtol=1e-12,
                atol=1e-14,
                dense_output=True,
                events=[leaves(LEVELS[piece], -1), leaves(LEVELS[piece + 1], 1)],
            )
            reached = solution.t[-1]
            for at in times:
                if t < at <= reached:
                    rows[at] = solution.sol(at)
            y, t = solution.y[:, -1].copy(), reached
            if solution.status == 1:
                y[0] = LEVELS[piece] if len(solution.t_events[0]) else LEVELS[piece + 1]
    return rows


def main():
    times = [float(t) for t in range(0, 7201, 120)]
    rows = run(times)
    comment = f"SciPy {scipy.__version__}: DOP853 from knot to knot, rtol 1e-12"
    unknowns = [("h", "m"), ("q", "m^3/s")]
    header = ["time [s]", "h [m]", "q [m^3/s]", *table.sensitivity_header(unknowns, [("K", "s^2/m^5")])]
    table.write("filling_pump.csv", [comment], header, [[at, *rows[at]] for at in times])
    powers = []
    for at in times:
        segment = max(k for k, (t, _, _) in enumerate(INPUTS[:-1]) if t <= at)
        powers.append([at, power(rows[at][1], inputs(at, segment)[0])])
    table.write("filling_pump_power.csv", [comment], ["time [s]", "power [W]"], powers)
    recorded = [[at, 100 * speed, q_out] for at, speed, q_out in INPUTS]
    table.write("filling_pump_inputs.csv", [], ["time [s]", "speed [%]", "q_out [m^3/h]"], recorded)


main()
