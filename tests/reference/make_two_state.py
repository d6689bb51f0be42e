"""References for the models with level h and flow q: mud circulation, its step, the benchmark.

    A dh/dt = q - q_in
    M dq/dt = rho g (h_in - h_out - h + c0 w^2 - c1 w q - c2 q|q|) - F1 q - F2 q|q|     (or 0 = ...)

Haukanes 2015: 2.32, 2.33 (dynamic), 3.17, 3.18 (static). The reference comes from `radau.py`; it is
compared with SciPy's DOP853 on the equations and sensitivity equations written out by hand, where
the static flow is eliminated by the formula for a quadratic equation.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import radau
import table

RHO, G = 1120.0, 9.81
HEAD = 307.0 - 302.0
RISER = mp.pi / 4 * (mpf("19.75") * mpf("0.0254")) ** 2
UNITS = {
    "M": "kg/m^4",
    "c0": "m",
    "c1": "s/m^2",
    "c2": "s^2/m^5",
    "F1": "Pa*s/m^3",
    "F2": "Pa*s^2/m^6",
}


@dataclass
class Case:
    """One model with its parameters, start and recording, in SI units."""

    name: str
    how: list  # comment lines for the header
    area: object
    parameters: dict  # name in the model -> (role in the equations, value)
    h0: float
    unknowns: tuple  # names of h and q
    rows: list  # (t, (w, flows...))
    linear: tuple = ()
    keep: int = 1  # every so many rows is written


def terms(case):
    """Roles with their values; a role that the model does not have is zero."""
    values = dict.fromkeys(UNITS, 0.0)
    values.update((role, value) for role, value in case.parameters.values())
    return values


def by_radau(case, static):
    """Rows t, h, q, dh/dp..., dq/dp... by collocation."""
    roles = [role for role, _ in case.parameters.values() if not (static and role == "M")]
    fixed, area = terms(case), mpf(case.area)

    def f(t, y, u, p):
        h, q = y
        w, *flows = u
        at = {**fixed, **dict(zip(roles, p))}
        head = HEAD - h + at["c0"] * w**2 - at["c1"] * w * q - at["c2"] * q * abs(q)
        net = mpf(RHO) * G * head - at["F1"] * q - at["F2"] * q * abs(q)
        return [(q - sum(flows)) / area, net / (mpf(10) ** 6 if static else at["M"])]

    problem = radau.Problem(
        f, [1, 0 if static else 1], [fixed[role] for role in roles], [10, 0.01], "1e-18", stages=8
    )
    q0 = sum(case.rows[0][1][1:])
    solutions = radau.simulate(problem, [case.h0, q0], case.rows, case.linear)
    return [[t, *y, *s[0], *s[1]] for (t, _), (y, s) in zip(case.rows, solutions)]


def by_scipy(case, static):
    """The same by DOP853, restarted at every row."""
    roles = [role for role, _ in case.parameters.values() if not (static and role == "M")]
    at, area, n = terms(case), float(case.area), len(roles)
    weight = RHO * G
    turbulent = weight * at["c2"] + at["F2"]

    def slopes(w, q):
        """d net / dq, and d net / dp for each role (that to M at fixed slope is not here)."""
        f_q = -weight * at["c1"] * w - at["F1"] - 2 * turbulent * abs(q)
        f_p = {"c0": weight * w**2, "c1": -weight * w * q, "c2": -weight * q * abs(q)}
        f_p.update({"M": 0.0, "F1": -q, "F2": -q * abs(q)})
        return f_q, np.array([f_p[role] for role in roles])

    def static_flow(w, h, s_h):
        linear = weight * at["c1"] * w + at["F1"]
        head = weight * (HEAD - h + at["c0"] * w**2)
        q = 2 * head / (linear + np.sqrt(linear**2 + 4 * turbulent * head))
        f_q, f_p = slopes(w, q)
        return q, (weight * s_h - f_p) / f_q

    def rhs(t, x, inputs):
        w, *flows = inputs(t)
        if static:
            q, s_q = static_flow(w, x[0], x[1:])
            return np.r_[(q - sum(flows)) / area, s_q / area]
        h, q, s_h, s_q = x[0], x[1], x[2 : 2 + n], x[2 + n :]
        f_q, f_p = slopes(w, q)
        net = (
            weight * (HEAD - h + at["c0"] * w**2 - at["c1"] * w * q)
            - at["F1"] * q
            - turbulent * q * abs(q)
        )
        if "M" in roles:
            f_p[roles.index("M")] = -net / at["M"]
        return np.r_[
            (q - sum(flows)) / area,
            net / at["M"],
            s_q / area,
            (-weight * s_h + f_q * s_q + f_p) / at["M"],
        ]

    sizes = [10.0 / (at[role] or 1.0) for role in roles]
    atol = 1e-15 * np.array(
        [10.0, *sizes] if static else [10.0, 0.01, *sizes, *(s * 1e-3 for s in sizes)]
    )
    x = (
        np.r_[case.h0, np.zeros(n)]
        if static
        else np.r_[case.h0, sum(case.rows[0][1][1:]), np.zeros(2 * n)]
    )
    solutions = []
    for k, (t1, u1) in enumerate(case.rows):
        t0, u0 = case.rows[k - 1] if k else (t1, u1)
        if t1 > t0:

            def inputs(t):
                s = (t - t0) / (t1 - t0)
                return [
                    a + s * (b - a) if i in case.linear else a
                    for i, (a, b) in enumerate(zip(u0, u1))
                ]

            x = solve_ivp(rhs, (t0, t1), x, "DOP853", args=(inputs,), rtol=1e-13, atol=atol).y[
                :, -1
            ]
        if static:
            q, s_q = static_flow(u1[0], x[0], x[1:])
            solutions.append([t1, x[0], q, *x[1:], *s_q])
        else:
            solutions.append([t1, *x])
    return solutions


def make(case):
    """Writes the reference of both variants."""
    for variant in ("dynamic", "static"):
        static = variant == "static"
        reference, check = by_radau(case, static), by_scipy(case, static)
        difference = table.largest_difference(reference, check)
        parameters = [
            (name, UNITS[role])
            for name, (role, _) in case.parameters.items()
            if not (static and role == "M")
        ]
        unknowns = list(zip(case.unknowns, ("m", "m^3/s")))
        comments = [
            f"{case.name}.dgd, flow = {variant}: states and sensitivities, SI units.",
            *case.how,
            "Every row is taken with the inputs of its own row.",
            *(
                ["M has no part in this variant: its sensitivities are zero and not listed."]
                if static
                else []
            ),
            f"Tool: radau.py (Radau IIA, 8 stages, {radau.DIGITS} digits, step tolerance 1e-18 against 6 stages).",
            f"Check: SciPy {scipy.__version__} DOP853, rtol 1e-13, restarted at every row"
            + (", q eliminated analytically;" if static else ";")
            + f" largest difference {difference:.1e} of a column's largest value.",
            "Made by make_two_state.py.",
        ]
        header = ["time [s]", *(f"{name} [{unit}]" for name, unit in unknowns)]
        header += table.sensitivity_header(unknowns, parameters)
        table.write(f"{case.name}_{variant}.csv", comments, header, reference[:: case.keep])
        print(f"{case.name} {variant}: differs from the check by {difference:.1e}")


def pump_speed_step():
    """The thesis' sensitivity study, from steady state, speed 10/1.1 -> 10 at 50 s."""
    rows = []
    _, recording = table.read(table.HERE / "../../examples/data/pump_speed_step.csv")
    for t in range(1001):
        row = max((r for r in recording if r[0] <= t), key=lambda r: r[0])
        rows.append((float(t), tuple(row[1:])))
    parameters = {
        "M": ("M", 1.1e8),
        "c0": ("c0", 0.39),
        "c1": ("c1", 0.5),
        "c2": ("c2", 2e4),
        "F": ("F2", 5.5e8),
    }
    how = [
        "Inputs: examples/data/pump_speed_step.csv (held). Haukanes 2015, section 3.2, figure 3.1."
    ]
    return Case("pump_speed_step", how, RISER, parameters, 9.117196027955, ("h", "q"), rows)


def bench_two_state():
    """P1 (dynamic) and P2 (static): speed 0.8 -> 0.88 at 100 s."""
    rows = [(float(t), (0.88 if t >= 100 else 0.8, 0.03, 0.002)) for t in range(1001)]
    parameters = {
        "M": ("M", 1.1e8),
        "c0": ("c0", 150.37469965050238),
        "c1": ("c1", 500.0),
        "c2": ("c2", 2e4),
        "F": ("F2", 3e8),
    }
    how = [
        "Inputs: bench_two_state_inputs.csv (held): w is 0.8, and 0.88 from t = 100 s on. Every tenth second."
    ]
    return Case("bench_two_state", how, 0.1976, parameters, 40.0, ("h", "q"), rows, keep=10)


def mud_circulation():
    """300 s of a recording: pump speed and top fill held, booster flow in straight lines."""
    _, recording = table.read(table.HERE / "mud_circulation_inputs.csv")
    rows = [(t, (w / 100, q_boost / 6e4, q_tf / 6e4)) for t, w, q_boost, q_tf in recording]
    parameters = {
        "M_ssp": ("M", 1.1e8),
        "c0": ("c0", 275.0),
        "c1": ("c1", 0.0),
        "c2": ("c2", 9.0e3),
        "F1": ("F1", 0.0),
        "F2": ("F2", 1.75e8),
    }
    how = [
        "Inputs: mud_circulation_inputs.csv; w_ssp and q_tf held, q_boost linear, with a jump at 200 s."
    ]
    return Case(
        "mud_circulation", how, RISER, parameters, 50.0, ("h_r", "q_ssp"), rows, linear=(1,)
    )


def write_mud_circulation_inputs():
    """Small moves of the pump and two steps, a booster ramp, a booster jump, top fill off."""
    rows = []
    for t in range(301):
        w = (
            52.0
            + 0.4 * np.sin(0.11 * t)
            + 0.15 * np.sin(0.9 * t)
            - (4.0 if t >= 75 else 0.0)
            + (2.5 if t >= 240 else 0.0)
        )
        q_boost = (
            np.interp(t, [60, 120], [1800.0, 1100.0])
            if t < 200
            else np.interp(t, [250, 280], [1350.0, 1700.0])
        )
        q_tf = 290.0 if t < 150 else 0.0
        if t == 200:
            # Left of the jump a held input still has its last value.
            rows.append((t, rows[-1][1], 1100.0, rows[-1][3]))
        rows.append((t, round(w, 3), round(q_boost, 1), q_tf))
    table.write(
        "mud_circulation_inputs.csv",
        [],
        ["time [s]", "w_ssp [%]", "q_boost [lpm]", "q_tf [lpm]"],
        rows,
    )


if __name__ == "__main__":
    write_mud_circulation_inputs()
    table.write(
        "bench_two_state_inputs.csv",
        [],
        ["time [s]", "w [1]"],
        [(0, 0.8), (100, 0.88), (1000, 0.88)],
    )
    for case in (pump_speed_step(), bench_two_state(), mud_circulation()):
        make(case)
