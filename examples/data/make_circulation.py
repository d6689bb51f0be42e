"""Makes circulation.csv: an hour of mud circulation, 1 Hz, as a rig would record it.

Nothing here was measured. The riser and its pump are those of models/mud_circulation.dgd with
parameters a few per cent off, so that a simulation with the model's own values is near the
recording and a fit has something to find. A PI controller moves the pump speed to hold the riser
pressure at its set point. The booster pump is stopped and restarted in ramps, as for a pipe
connection, and top fill is switched off for ten minutes. Sensors have white noise of the size that
the model declares.

    A_r dh/dt = q - q_boost - q_tf
    M dq/dt   = rho g (h_in - h_out - h + c0 w^2 - c2 q|q|) - F2 q|q|

Run: python3 make_circulation.py
"""

import csv
import random
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

RHO, G, P_ATM = 1120.0, 9.81, 101325.0
H_IN, H_OUT, H_PR = 307.0, 302.0, 305.0
A_R = np.pi / 4 * (19.75 * 0.0254) ** 2
M, C0, C2, F2 = 0.9e8, 281.0, 9.6e3, 1.82e8
LPM = 1 / 60000

DURATION = 3600
BOOSTER = [  # min, lpm; straight lines between
    (0, 1850), (12, 1850), (13.5, 950), (20, 950), (21, 1850),
    (34, 1850), (35, 1400), (36, 1400), (37.5, 500), (46, 500), (48.5, 2000), (60, 2000),
]  # fmt: skip
TOP_FILL = [(0, 290), (26, 0), (36, 290), (54, 140)]  # min, lpm; held
LEVEL = [(0, 50.0), (5, 52.0), (29, 48.5), (51, 51.0)]  # min, m: set point of the controller
K_P, T_I = 12.0, 120.0  # % of speed per bar, s


def held(schedule, minute):
    """Value of the last entry that has begun."""
    return [value for start, value in schedule if start <= minute][-1]


def net_pressure(h, q, w):
    """Pressure that accelerates the mud in the return line."""
    return RHO * G * (H_IN - H_OUT - h + C0 * w**2 - C2 * q * abs(q)) - F2 * q * abs(q)


def main():
    """Simulates second by second and writes circulation.csv beside this script."""
    noise = random.Random(2015)
    minutes, flows = zip(*BOOSTER)
    booster = [round(float(np.interp(t / 60, minutes, flows)), 1) for t in range(DURATION + 1)]
    h = LEVEL[0][1]
    q = (booster[0] + TOP_FILL[0][1]) * LPM
    # Speed at which the start is steady: net_pressure = 0.
    w_start = np.sqrt((h - H_IN + H_OUT + C2 * q**2 + F2 * q**2 / (RHO * G)) / C0)
    integral = 100 * w_start

    rows = []
    for t in range(DURATION + 1):
        p_r = (P_ATM + RHO * G * (H_PR - h)) / 1e5 + noise.gauss(0, 0.01)
        set_point = (P_ATM + RHO * G * (H_PR - held(LEVEL, t / 60))) / 1e5
        # More speed takes mud away and lowers the pressure.
        error = p_r - set_point
        integral += K_P / T_I * error
        w = round(min(100.0, max(30.0, integral + K_P * error)), 2)
        q_tf = held(TOP_FILL, t / 60)

        suction = RHO * G * (H_IN - h)
        pump = RHO * G * (C0 * (w / 100) ** 2 - C2 * q * abs(q))
        rows.append(
            [
                t,
                f"{w:.2f}",
                f"{booster[t]:.1f}",
                q_tf,
                f"{p_r:.3f}",
                f"{suction / 1e5 + noise.gauss(0, 0.01):.3f}",
                f"{(suction + pump) / 1e5 + noise.gauss(0, 0.01):.3f}",
                f"{q / LPM + noise.gauss(0, 15):.1f}",
            ]
        )
        if t == DURATION:
            break

        def rhs(s, x, w=w / 100, t=t, q_tf=q_tf):
            q_boost = booster[t] + (s - t) * (booster[t + 1] - booster[t])
            return [(x[1] - (q_boost + q_tf) * LPM) / A_R, net_pressure(x[0], x[1], w) / M]

        h, q = solve_ivp(rhs, (t, t + 1), [h, q], first_step=1.0, rtol=1e-8, atol=1e-10).y[:, -1]

    header = "time [s],w_ssp [%],q_boost [lpm],q_tf [lpm],p_r [bara],p_in [barg],p_out [barg],q_ssp [lpm]"
    with open(Path(__file__).with_name("circulation.csv"), "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header.split(","))
        writer.writerows(rows)


if __name__ == "__main__":
    main()
