"""Makes case_1.csv and case_2.csv: recordings on which the thesis' final model can be verified.

Nothing here was measured: the recordings of Haukanes 2015, chapter 4, are confidential. Case 1 is
normal circulation, in case 2 the booster pump is ramped down and up several times. Riser, pump and
return line are those of models/mud_circulation_u_tubing.dgd with its own values, and this rig has
besides what that model neglects: the inertia falls with the level (3.15, to the scale that was
identified), the subsea pump lags behind its reference (2.29), and the booster line is a column with
the two weights that section 3.7.1 found (3.12). As long as the column's own flow is less than what
comes in, the line is full, and the larger of that flow and the pump's leaves it. A PI controller
moves the subsea pump's speed every five seconds, by the measured riser pressure, and the driller's
hand helps it when the booster pump is ramped. Sensors are noisy and have two decimals.

    A_r dh_r/dt  = q - q_bo - q_tf
    M dq_m/dt    = rho g (h_in - h_out - h_r + c0 w^k - c2 q_m|q_m|) - F(q_m)
    tau dw/dt    = w_ref - w
    M_b dq_bo/dt = rho g (h_r - theta_hb h_b) - F_b q_bo        while the line is not full
    A_b dh_b/dt  = q_bo - theta_b q_boost

with q the flow and q_m = q/theta_1 what the meter reads; F is the polynomial of fourth order.

Run: python3 make_verification.py
"""

import csv
import math
import random
from pathlib import Path

RHO, G, P_ATM = 1120.0, 9.81, 101325.0
H_IN, H_OUT, H_PR = 307.0, 302.0, 305.0
A_R = math.pi / 4 * (19.75 * 0.0254) ** 2
THETA_1, C0, K, C2 = 0.951, 400.0, 1.8, 9.0e3
F1, F2, F3, F4 = 1e6, 1.5e8, -2e8, 1.5e10
M, M_FALL = 1.1e8, 1.1e8 * 5.6e3 / 2e7  # kg/m^4, and per metre of level: the ratio of 3.15
LAG = 1.0  # s
A_B, L_BO, F_B = 0.0103, 340.0, 6e7
THETA_HB, THETA_B = 1.5, 3.6
HAND = 0.003  # % of speed per lpm of the booster pump
LPM = 1 / 60000
STEP, SUBSTEPS = 5, 100  # s between samples

CASE_1 = {
    "minutes": 60,
    "least": 40.0,  # % of speed, limits of the controller
    "most": 100.0,
    "booster": [(0, 2300), (60, 2300)],  # min, lpm; straight lines between
    "top_fill": [(0, 300), (22, 150), (41, 300)],  # min, lpm; held
    "level": [(0, 120.0), (6, 126.0), (16, 121.0), (30, 131.0), (46, 118.0)],  # min, m; set point
}
RAMP = 0.5  # min
CASE_2 = {
    "minutes": 100,
    "least": 60.0,
    "most": 82.0,
    "booster": [
        (0, 2300), (8, 2300), (8 + RAMP, 0), (15, 0), (15 + RAMP, 2300),
        (27, 2300), (27 + RAMP, 0), (33, 0), (33 + RAMP, 2300),
        (46, 2300), (46 + RAMP, 0), (58, 0), (58 + RAMP, 2300),
        (72, 2300), (72 + RAMP, 0), (76, 0), (76 + RAMP, 2300), (100, 2300),
    ],
    "top_fill": [(0, 300), (50, 200), (56, 300)],
    "level": [(0, 200.0), (22, 207.0), (40, 195.0), (66, 203.0), (88, 198.0)],
}  # fmt: skip


def held(schedule, minute):
    """Value of the last entry that has begun."""
    return [value for start, value in schedule if start <= minute][-1]


def between(schedule, minute):
    """Value on the straight lines between the entries."""
    minute = max(minute, schedule[0][0])
    for (a, x), (b, y) in zip(schedule, schedule[1:]):
        if minute <= b:
            return x + (y - x) * (minute - a) / (b - a)
    return schedule[-1][1]


def head_loss(q_m):
    """Of pump and return line, m."""
    friction = F1 * q_m + F2 * q_m * abs(q_m) + F3 * q_m**3 + F4 * q_m**3 * abs(q_m)
    return C2 * q_m * abs(q_m) + friction / (RHO * G)


def delivered(own, q_boost, full):
    """What leaves the booster line, whose column alone would let `own` out."""
    return max(own, q_boost) if full else own


def rates(state, full, w_ref, q_boost, q_tf):
    """Derivatives of level, return flow, speed, and of the column's own flow and level."""
    h_r, q_m, w, own, h_b = state
    net = RHO * G * (H_IN - H_OUT - h_r + C0 * w**K - head_loss(q_m))
    return [
        (THETA_1 * q_m - delivered(own, q_boost, full) - q_tf) / A_R,
        net / (M - M_FALL * (h_r - 200.0)),
        (w_ref - w) / LAG,
        (RHO * G * (h_r - THETA_HB * h_b) - F_B * own) / (RHO / A_B * (L_BO - h_b)),
        0.0 if full else (own - THETA_B * q_boost) / A_B,
    ]


def advanced(state, full, w_ref, q_tf, boost, h):
    """One step of Runge and Kutta; `boost` is the pump's flow at its beginning, middle and end."""

    def at(k, share):
        return [x + share * h * dx for x, dx in zip(state, k)]

    k1 = rates(state, full, w_ref, boost[0], q_tf)
    k2 = rates(at(k1, 0.5), full, w_ref, boost[1], q_tf)
    k3 = rates(at(k2, 0.5), full, w_ref, boost[1], q_tf)
    k4 = rates(at(k3, 1.0), full, w_ref, boost[2], q_tf)
    new = [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(state, k1, k2, k3, k4)]
    if full:
        full = new[3] <= THETA_B * boost[2]
    elif new[4] <= 0:
        full, new[4] = True, 0.0
    return new, full


def record(case, seed):
    """Rows of a recording."""
    noise = random.Random(seed)
    q_tf = held(case["top_fill"], 0) * LPM
    q_boost = case["booster"][0][1] * LPM
    h_r = case["level"][0][1]
    q_m = (q_boost + q_tf) / THETA_1
    w = ((h_r - H_IN + H_OUT + head_loss(q_m)) / C0) ** (1 / K)
    state, full = [h_r, q_m, w, RHO * G * h_r / F_B, 0.0], True
    k_p, t_i, integral = 1.5, 250.0, 100 * w  # % of speed per bar, s
    first = case["booster"][0][1]

    for t in range(0, 60 * case["minutes"] + 1, STEP):
        p_r = (P_ATM + RHO * G * (H_PR - state[0])) / 1e5 + noise.gauss(0, 0.01)
        set_point = (P_ATM + RHO * G * (H_PR - held(case["level"], t / 60))) / 1e5
        # More speed takes mud away and lowers the pressure.
        error = p_r - set_point
        # The driller slows the subsea pump down half a minute after the booster pump.
        hand = HAND * (between(case["booster"], t / 60 - 0.5) - first)
        wanted = integral + k_p * error + hand
        w_ref = round(min(case["most"], max(case["least"], wanted)), 2)
        if case["least"] < wanted < case["most"]:
            integral += k_p / t_i * error * STEP
        q_tf = held(case["top_fill"], t / 60)
        suction = RHO * G * (H_IN - state[0])
        q_m = state[1]
        pump = RHO * G * (C0 * state[2] ** K - C2 * q_m * abs(q_m))
        yield [
            t,
            f"{w_ref:.2f}",
            f"{between(case['booster'], t / 60):.1f}",
            q_tf,
            f"{p_r:.2f}",
            f"{suction / 1e5 + noise.gauss(0, 0.01):.2f}",
            f"{(suction + pump) / 1e5 + noise.gauss(0, 0.01):.2f}",
            f"{q_m / LPM + noise.gauss(0, 15):.0f}",
        ]
        h = STEP / SUBSTEPS
        for i in range(SUBSTEPS):
            minutes = [(t + (i + part) * h) / 60 for part in (0, 0.5, 1)]
            boost = [between(case["booster"], minute) * LPM for minute in minutes]
            state, full = advanced(state, full, w_ref / 100, q_tf * LPM, boost, h)


def main():
    """Writes the recordings beside this script."""
    header = "time [s],w_ssp [%],q_boost [lpm],q_tf [lpm],p_r [bara],p_in [barg],p_out [barg],q_ssp [lpm]"
    for name, case, seed in [("case_1", CASE_1, 1), ("case_2", CASE_2, 2)]:
        with open(Path(__file__).with_name(f"{name}.csv"), "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header.split(","))
            writer.writerows(record(case, seed))


if __name__ == "__main__":
    main()
