#!/usr/bin/env python3
"""The two recordings of docs/tutorial.md: an oven whose heater gives less than it is told.

    C dT/dt = min(P, limit) - k (T - T_room)

Nothing here is shared with dgd: the equation is solved step by step, exactly, since all but T is held for a step.
"""
import math
import random

CAPACITY = 9000.0  # J/K
LOSS = 12.0  # W/K
LIMIT = 1800.0  # W, of the fuse that nobody thought of
STEP = 10.0  # s
ROWS = 601
NOISE = 0.15  # K, of the thermometer


def recording(name, seed, levels, room):
    draw = random.Random(seed)
    temperature = room
    power, until = 0.0, 0
    lines = ["time [s],P [W],T_room [degC],T [degC]"]
    for row in range(ROWS):
        if row >= until:
            power = draw.choice([level for level in levels if level != power])
            until = row + draw.randint(20, 70)
        surrounding = room + 1.5 * math.sin(2.0 * math.pi * row / 400.0)
        measured = temperature + draw.gauss(0.0, NOISE)
        lines.append(f"{row * STEP:.0f},{power:.0f},{surrounding:.2f},{measured:.2f}")
        # As recorded: what a model is given is what acts.
        steady = round(surrounding, 2) + min(power, LIMIT) / LOSS
        temperature = steady + (temperature - steady) * math.exp(-STEP * LOSS / CAPACITY)
    with open(name, "w", encoding="ascii", newline="\n") as file:
        file.write("\n".join(lines) + "\n")


recording("train.csv", 1, [0.0, 600.0, 1200.0, 2400.0, 3000.0], 21.0)
recording("valid.csv", 2, [0.0, 900.0, 1500.0, 2000.0, 2700.0], 19.0)
