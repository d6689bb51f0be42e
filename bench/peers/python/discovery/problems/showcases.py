"""SciML's two showcases: animals whose interactions are unknown, and a bioreactor without a growth law.

After "Automatically Discover Missing Physics" of the SciML documentation (Rackauckas et al., 2020, for the
animals; Strouwen, 2025, for the bioreactor); constants are theirs, starts, feeds and noise are drawn.
"""

import numpy as np
from problem import Problem, State, with_noise
from scipy.integrate import solve_ivp

EACH = 4


def problems(seed, _each):
    for k in range(EACH):
        yield animals(np.random.default_rng([seed, 1, k]), k + 1)
        yield bioreactor(np.random.default_rng([seed, 2, k]), k + 1)


ANIMALS = """\
/// Rabbits and wolves that have never met.
model lv
constant alpha [1/s] = 1.3
constant delta [1/s] = 1.8
state x [1] = 3
state y [1] = 4
equation rabbits: der(x) = alpha*x
equation wolves:  der(y) = -delta*y
output x noise 0.02
output y noise 0.02
"""


def animals(random, number):
    """21 readings within 5 s; the noise is half a percent of the mean."""
    rate = lambda _, x: [1.3 * x[0] - 0.9 * x[0] * x[1], -1.8 * x[1] + 0.8 * x[0] * x[1]]
    time = np.linspace(0, 5, 21)
    plain = {}
    for name in ("train1", "valid", "judge"):
        start = random.uniform([1.0, 1.0], [5.0, 5.0])
        x, y = solve_ivp(rate, (0, 5), start, t_eval=time, rtol=1e-10, atol=1e-12).y
        plain[name] = {"time": time, "x": x, "y": y}
    noise = {name: 0.005 * float(np.mean(plain["train1"][name])) for name in "xy"}
    return Problem(
        name=f"lotka_volterra_{number}",
        text=ANIMALS,
        states={"x": State("rabbits", "1", "1.3*x"), "y": State("wolves", "1", "-1.8*y")},
        noise=noise,
        recordings={name: recording if name == "judge" else with_noise(recording, noise, random)
                    for name, recording in plain.items()},
        missing={"rabbits": "-0.9*x*y", "wolves": "0.8*x*y"},
        places=[{"rabbits", "wolves"}],
        targets={"rabbits": "1/s", "wolves": "1/s"},
    )


BIOREACTOR = """\
/// Fed-batch bioreactor whose growth law is not known.
model bioreactor
input Q_in [L/h] hold
parameter mu [1/h] = 0.1 in 0 ..
constant C_in [g/L] = 50
constant Y [1] = 0.777
state C_s [g/L] = 1 fixed
state C_x [g/L] = 1 fixed
state V [L] = 7 fixed
equation substrate: der(C_s) = -mu/Y*C_x + Q_in/V*(C_in - C_s)
equation biomass:   der(C_x) = mu*C_x - Q_in/V*C_x
equation volume:    der(V) = Q_in exact
output C_s noise 0.1 [g/L]
"""


def bioreactor(random, number):
    """The substrate is measured each hour for 15 h; feeds are drawn, with one batch that is not fed."""
    feeds = {name: fed(random) for name in ("train2", "valid", "judge")} | {"train1": np.zeros(16)}
    noise = {"C_s": 0.1}
    recordings = {}
    for name, feed in sorted(feeds.items()):
        recording = fermented(feed)
        recordings[name] = recording if name == "judge" else with_noise(recording, noise, random)
    return Problem(
        name=f"bioreactor_{number}",
        text=BIOREACTOR,
        states={"C_s": State("substrate", "g/L", "-0.1/0.777*C_x + Q_in/V*(50 - C_s)"),
                "C_x": State("biomass", "g/L", "0.1*C_x - Q_in/V*C_x"),
                "V": State("volume", "L", "Q_in")},
        noise=noise,
        recordings=recordings,
        missing={"mu": "0.421*C_s/(4.39 + C_s)"},
        places=[{"mu"}, {"substrate", "biomass"}],
        time_unit="h",
        inputs={"Q_in": "hold"},
        units={"Q_in": "L/h"},
        targets={"substrate": "g/(L*h)", "biomass": "g/(L*h)", "mu": "1/h"},
    )


def fed(random):
    """Three or four hours with a feed of 1 to 10 L/h."""
    feed = np.zeros(16)
    hours = random.choice(13, random.integers(3, 5), replace=False)
    feed[hours] = np.round(random.uniform(1, 10, len(hours)))
    return feed


def fermented(feed):
    now, values = np.array([1.0, 1.0, 7.0]), []
    for hour, flow in enumerate(feed):
        values.append(now)

        def rate(_, x, flow=flow):
            growth = 0.421 * x[0] / (4.39 + x[0])
            dilution = flow / x[2]
            return [-growth / 0.777 * x[1] + dilution * (50 - x[0]), growth * x[1] - dilution * x[1], flow]

        now = solve_ivp(rate, (hour, hour + 1), now, "LSODA", rtol=1e-10, atol=1e-12).y[:, -1]
    return {"time": np.arange(16.0), "Q_in": feed} | dict(zip(("C_s", "C_x", "V"), np.array(values).T))
