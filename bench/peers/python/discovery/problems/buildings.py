"""Rooms with a term that acts in one regime only, the kind of problem of LISDD (Wang, 2026, arXiv 2606.23215).

A room of air and walls whose constants are known, both temperatures measured every five minutes for a week.
What is missing: a vent whose wax motor opens it above a temperature of the room, a window that is open while it
is warm outside, or a fan in the night whose switch is recorded, but not in the model. Days that judge are warmer:
a formula that only describes the recorded days predicts them badly.
"""

from dataclasses import dataclass

import numpy as np
from problem import Problem, State, with_noise

EACH = 4
STEP, DAY = 300.0, 86400.0
SUBSTEPS = 10
# Difference between the judge's days and the recorded ones, K.
WARMER = 3.0


def problems(seed, _each):
    for k in range(EACH):
        for number, kind in enumerate((vent, window, fan)):
            yield kind(np.random.default_rng([seed, 3 + number, k]), k + 1)


@dataclass
class Room:
    """In J/K and W/K."""

    air: float
    wall: float
    inner: float
    outer: float
    windows: float

    @classmethod
    def drawn(cls, random):
        low, high = [1.5e6, 15e6, 250, 60, 40], [4e6, 40e6, 500, 130, 80]
        return cls(*(float(f"{value:.3g}") for value in random.uniform(low, high)))

    def known(self):
        """Rates of both temperatures, in K/s."""
        return {"T_a": f"(P + {self.inner}*(T_w - T_a) + {self.windows}*(T_out - T_a))/{self.air}",
                "T_w": f"({self.inner}*(T_a - T_w) + {self.outer}*(T_out - T_w))/{self.wall}"}

    def text(self):
        return f"""\
/// A room: its air and its walls.
model room
input P     [W]    hold     /// heating, people and sunshine
input T_out [degC] linear   /// outdoors
constant C_a  [J/K] = {self.air:.10g}
constant C_w  [J/K] = {self.wall:.10g}
constant G_aw [W/K] = {self.inner:.10g}   /// air to wall
constant G_wo [W/K] = {self.outer:.10g}   /// wall to outdoors
constant G_ao [W/K] = {self.windows:.10g}   /// windows
state T_a [degC] = 21
state T_w [degC] = 20
equation air:  C_a*der(T_a) = P + G_aw*(T_w - T_a) + G_ao*(T_out - T_a)
equation wall: C_w*der(T_w) = G_aw*(T_a - T_w) + G_wo*(T_out - T_w)
output T_a noise 0.05 [K]
output T_w noise 0.05 [K]
"""


def vent(random, number):
    room, share, gain = Room.drawn(random), random.uniform(0.6, 0.75), random.uniform(20, 60)
    # It is open for a third of the time or less.
    shut = simulated(room, weather(random, 7), lambda t, air, out: 0.0, (21.0, 20.0))
    level = float(f"{np.quantile(shut['T_a'], share):.4g}")
    loss = lambda t, air, out: gain * max(air - level, 0) * (air - out)
    return problem(f"vent_{number}", room, random, loss, f"-{gain:.4g}*max(T_a - {level}, 0)*(T_a - T_out)")


def window(random, number):
    room, level, gain = Room.drawn(random), random.uniform(14, 17), random.uniform(60, 160)
    loss = lambda t, air, out: gain * (air - out) if out > level else 0.0
    return problem(f"window_{number}", room, random, loss,
                   f"-{gain:.4g}*(T_a - T_out) while T_out > {level:.4g}")


def fan(random, number):
    room, gain = Room.drawn(random), random.uniform(60, 160)
    begin, length = random.uniform(20, 23), random.uniform(6, 9)
    runs = lambda t: float((t / 3600 - begin) % 24 < length)
    loss = lambda t, air, out: gain * runs(t) * (air - out)
    return problem(f"fan_{number}", room, random, loss, f"-{gain:.4g}*fan*(T_a - T_out)", runs)


def problem(name, room, random, loss, missing, runs=None):
    noise = {"T_a": 0.05, "T_w": 0.05}
    recordings = {}
    for part, days in (("train1", 7), ("valid", 5), ("judge", 5)):
        start = random.uniform([20, 19], [23, 22])
        recording = simulated(room, weather(random, days, WARMER if part == "judge" else 0.0), loss, start)
        if runs:
            recording["fan"] = np.array([runs(t) for t in recording["time"]])
        recordings[part] = recording if part == "judge" else with_noise(recording, noise, random)
    rates = room.known()
    return Problem(
        name=name,
        text=room.text(),
        states={"T_a": State("air", "degC", rates["T_a"]), "T_w": State("wall", "degC", rates["T_w"])},
        noise=noise,
        recordings=recordings,
        missing={"air": missing},
        places=[{"air"}],
        inputs={"P": "hold", "T_out": "linear"},
        columns={"fan": "hold"} if runs else {},
        units={"P": "W", "T_out": "degC", "fan": "1"},
        targets={"air": "W", "wall": "W"},
    )


def weather(random, days, warmer=0.0):
    """Sunny and dull days of May, with the heat that comes into the room, and its outdoor temperature."""
    time = np.arange(0, days * DAY + 1, STEP)
    hour, day = time / 3600 % 24, np.minimum((time // DAY).astype(int), days - 1)
    cloud = random.uniform(0.2, 1.0, days)[day]
    sun = np.clip(np.sin(np.pi * (hour - 6) / 14), 0, None) * (hour > 6) * (hour < 20)
    people = 300.0 * ((hour > 7) & (hour < 9) | (hour > 17) & (hour < 23))
    heat = np.round(200 + people + 1800 * sun * cloud)
    drift = np.cumsum(random.standard_normal(len(time))) * 0.04
    outdoors = 14 + warmer + 6 * np.sin(2 * np.pi * (hour - 9) / 24) * (0.4 + 0.6 * cloud) + drift
    return {"time": time, "P": heat, "T_out": np.round(outdoors, 2)}


def simulated(room, weather, loss, start):
    """By small steps of the trapezoidal rule (Heun); the heat is held, the outdoor temperature is linear."""
    (air, wall), step, shown = start, STEP / SUBSTEPS, []

    def rates(t, air, wall, heat, out):
        inner = room.inner * (wall - air)
        return ((heat + inner + room.windows * (out - air) - loss(t, air, out)) / room.air,
                (-inner + room.outer * (out - wall)) / room.wall)

    time, outdoors = weather["time"], weather["T_out"]
    for k, heat in enumerate(weather["P"]):
        shown.append((air, wall))
        slope = (outdoors[k + 1] - outdoors[k]) / STEP if k + 1 < len(time) else 0.0
        for part in range(SUBSTEPS):
            t, out = time[k] + part * step, outdoors[k] + slope * part * step
            a1, w1 = rates(t, air, wall, heat, out)
            a2, w2 = rates(t + step, air + step * a1, wall + step * w1, heat, out + slope * step)
            air, wall = air + step / 2 * (a1 + a2), wall + step / 2 * (w1 + w2)
    return weather | dict(zip(("T_a", "T_w"), np.array(shown).T))
