"""The score of an answer: a start that no tool has seen is simulated with what the tool has added.

An answer is right if that simulation is off by less than a twentieth of each state's spread, and if something
was added in every equation that lacks something. So any algebraic form of the missing term is right, and so is
one that cannot be told from it there; a wrong sign, place or coefficient is not.
"""

import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from bank import Said, seconds_per_unit, table

LIMIT = 0.05


@dataclass
class Answer:
    """What a tool names, and how far off the simulation from the judge's start is with it.

    Without a claim only the first place counts.
    """

    text: str = "nothing"
    places: list = field(default_factory=list)
    is_claimed: bool = False
    error: float = np.inf


def scored(case, answer):
    is_there = any(places <= set(answer.places) for places in case.places)
    says = Said(text=f"{answer.text} | error {answer.error:.3g}" if answer.is_claimed else answer.text)
    if answer.is_claimed:
        says.is_right_name = is_there and answer.error < LIMIT
        says.is_wrong = not says.is_right_name
    else:
        says.is_right_place = any(answer.places[:1] == [place] for places in case.places for place in places)
    return says


def error(case, simulated):
    """The largest root mean square of a state's error over its spread; infinite for what did not end."""
    judged, worst = case.judged, 0.0
    for name in case.states:
        values = None if simulated is None else np.asarray(simulated[name], float)
        if values is None or len(values) != len(judged) or not np.isfinite(values).all():
            return np.inf
        spread = np.std(judged[name]) + 1e-9
        worst = max(worst, np.sqrt(np.mean((values - judged[name]) ** 2)) / spread)
    return float(worst)


def error_of_model(case, model):
    """That of a model in dgd's language, which dgd simulates."""
    start = [part for name in case.states
             for part in ("--set", f"{name}={float(case.judged[name][0])!r}")]
    with tempfile.TemporaryDirectory() as folder:
        shown = Path(folder) / "shown.csv"
        case.run("simulate", model, "--data", case.judge, "-o", shown, *start)
        if not shown.exists():
            return np.inf
        frame, header = table(shown)
    # dgd shows seconds, whatever the recording's unit is.
    time = frame["time"].to_numpy() * seconds_per_unit(header)
    judged = case.judged["time"].to_numpy() * seconds_per_unit(case.judged_header)
    if len(time) < 2 or time[-1] < judged[-1] * 0.999:
        return np.inf
    return error(case, {name: np.interp(judged, time, frame[name])
                        for name in case.states if name in frame})

