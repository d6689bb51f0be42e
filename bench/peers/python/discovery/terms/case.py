"""A case of `problems`: its files, its truth, and its recordings as numbers."""

import json
from functools import cached_property

from bank import run, table

KINDS = ("one term", "two terms", "half measured", "showcase", "regime")


class Case:
    #: Where the modules of the tools are.
    package = "terms."

    def __init__(self, folder, dgd):
        self.folder, self.dgd, self.name = folder, dgd, folder.name
        self.truth = json.loads((folder / "truth.json").read_text())
        self.kind, self.places = self.truth["kind"], [set(places) for places in self.truth["places"]]
        self.model = folder / "model.dgd"

    @property
    def states(self):
        return self.truth["states"]

    @property
    def given(self):
        """Inputs and the columns that the model does not read, with `hold` or `linear`."""
        return self.truth["inputs"] | self.truth["columns"]

    @property
    def is_measured(self):
        """Whether all states are."""
        return set(self.states) <= set(self.truth["noise"])

    @property
    def train(self):
        return sorted(self.folder.glob("train*.csv"))

    @property
    def valid(self):
        return self.folder / "valid.csv"

    @property
    def judge(self):
        return self.folder / "judge.csv"

    @cached_property
    def judged(self):
        """The judge's recording: time, inputs and all states."""
        return table(self.judge)[0]

    @cached_property
    def judged_header(self):
        return table(self.judge)[1]

    def data(self):
        """The recordings to fit, as arguments of dgd."""
        return [part for path in self.train for part in ("--data", path)]

    def run(self, *arguments, limit=60):
        """Runs dgd with one thread; None if it fails, or needs more seconds of a processor."""
        return run(self.dgd, *arguments, limit=limit)
