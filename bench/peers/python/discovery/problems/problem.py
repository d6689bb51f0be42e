"""A case with its recordings and its truth, and how they are written."""

import json
from dataclasses import dataclass, field

import numpy as np


@dataclass
class State:
    """A state, the equation of its rate, and as much of that rate as the model has, in numbers."""

    equation: str
    unit: str
    #: In the recorded units, per recorded unit of time.
    rate: str


@dataclass
class Problem:
    name: str
    text: str
    states: dict
    #: Outputs, each of them a state, with the standard deviation of their noise.
    noise: dict
    #: Names of recordings, `train…`, `valid` and `judge`: time and the values of inputs, columns and states.
    recordings: dict
    #: What each equation lacks.
    missing: dict
    #: Sets of places, any of which is right.
    places: list
    time_unit: str = "s"
    #: Inputs of the model, with `hold` or `linear`, and columns that the model does not read.
    inputs: dict = field(default_factory=dict)
    columns: dict = field(default_factory=dict)
    units: dict = field(default_factory=dict)
    #: The unit of an equation's right-hand side, and of a free parameter that may be a law.
    targets: dict = field(default_factory=dict)

    def write(self, out, kind):
        folder = out / self.name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "model.dgd").write_text(self.text)
        for name, recording in self.recordings.items():
            # The judge has all states, and no noise.
            shown = list(self.states) if name == "judge" else list(self.noise)
            self._record(folder / f"{name}.csv", recording, [*self.inputs, *self.columns, *shown])
        truth = {
            "kind": kind,
            "missing": self.missing,
            "places": [sorted(places) for places in self.places],
            "states": {name: vars(state) for name, state in self.states.items()},
            "noise": self.noise,
            "time_unit": self.time_unit,
            "inputs": self.inputs,
            "columns": self.columns,
            "units": self._units(),
            "targets": self.targets,
        }
        (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")

    def _units(self):
        return self.units | {name: state.unit for name, state in self.states.items()}

    def _record(self, path, recording, names):
        units = self._units()
        heads = [f"time [{self.time_unit}]", *(f"{name} [{units[name]}]" for name in names)]
        rows = np.column_stack([recording["time"], *(recording[name] for name in names)])
        with path.open("w", encoding="utf-8") as file:
            file.write(",".join(heads) + "\n")
            np.savetxt(file, rows, delimiter=",", fmt="%.8g")


def with_noise(recording, noise, random):
    return recording | {name: recording[name] + std * random.standard_normal(len(recording["time"]))
                        for name, std in noise.items()}
