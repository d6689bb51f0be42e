"""Cases of the bank: their files, what they hide, and runs of dgd on them."""

import json
import os
import re
import resource
import subprocess
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path

import pandas as pd

KINDS = ("library", "template", "parameter", "nothing")
SECONDS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass
class Said:
    """What a tool says of a case, as it is scored."""

    is_right_name: bool = False
    is_right_place: bool = False
    is_wrong: bool = False
    text: str = ""
    seconds: float = 0.0


@dataclass
class Equation:
    """`factor * der(state) = rate`."""

    name: str
    state: str
    rate: str
    is_exact: bool


@dataclass
class Model:
    """What a model declares, read line by line."""

    text: str
    inputs: dict = field(default_factory=dict)
    parameters: dict = field(default_factory=dict)
    states: dict = field(default_factory=dict)
    lets: dict = field(default_factory=dict)
    equations: list = field(default_factory=list)
    outputs: dict = field(default_factory=dict)

    def __post_init__(self):
        for line in self.text.splitlines():
            self._read(line.split("///")[0].strip())

    def _read(self, line):
        word, _, rest = line.partition(" ")
        declared = re.match(r"\s*(\w+)\s*(?:\[(.*?)\])?\s*(.*)", rest)
        if word == "input":
            self.inputs[declared[1]] = declared[3].split()[0]
        elif word == "parameter":
            self.parameters[declared[1]] = declared[2]
        elif word == "state":
            self.states[declared[1]] = declared[2]
        elif word in ("let", "function"):
            self.lets[declared[1]] = rest.split("=", 1)[1]
        elif word == "equation":
            found = re.match(r"(\w+):\s*(?:(.*?)\s*\*\s*)?der\((\w+)\) = (.*?)( exact)?$", rest)
            name, factor, state, right, exact = found.groups()
            rate = f"({right})/({factor})" if factor else f"({right})"
            self.equations.append(Equation(name, state, rate, exact is not None))
        elif word == "output":
            shown = re.sub(r"(^|\s+)noise .*", "", declared[3]).lstrip("= ").strip() or declared[1]
            self.outputs[declared[1]] = (declared[2], shown)

    def measured(self):
        """States with an output of their own."""
        return [state for state in self.states if self.outputs.get(state, ("", ""))[1] == state]

    def readings(self):
        """Outputs that are not a state."""
        return {name: shown for name, (_, shown) in self.outputs.items() if name not in self.measured()}

    def rate_of(self, state):
        return next(equation.rate for equation in self.equations if equation.state == state)

    def reads(self, expression):
        """All names that an expression depends on, with equations of the states that are not measured."""
        reached, todo = set(), NAME.findall(expression)
        while todo:
            name = todo.pop()
            if name in reached:
                continue
            reached.add(name)
            todo += NAME.findall(self.lets.get(name, ""))
            if name in self.states and name not in self.measured():
                todo += [equation.name for equation in self.equations if equation.state == name]
                todo += NAME.findall(self.rate_of(name))
        if "der" in reached:
            reached |= {equation.name for equation in self.equations
                        if f"der({equation.state})" in expression}
        return reached


class Case:
    """A folder of the bank."""

    #: Where the modules of the tools are.
    package = ""

    def __init__(self, folder, dgd):
        self.folder, self.dgd, self.name = folder, dgd, folder.name
        self.truth = json.loads((folder / "truth.json").read_text())
        self.kind, self.hidden = self.truth["kind"], self.truth["hidden"]

    @cached_property
    def model(self):
        return Model((self.folder / "model.dgd").read_text())

    @cached_property
    def effects(self):
        """Files of the library by their names."""
        return {path.stem: path for path in sorted((self.folder / "effects").glob("*.dgd"))}

    def path(self, name):
        return str(self.folder / name)

    def run(self, *arguments):
        """Runs dgd with one thread; gives what it prints as JSON, or None if it fails."""
        return run(self.dgd, *arguments)

    def places(self):
        """Where something is hidden: equations, inputs, parameters, `let`s, and outputs as `sensor NAME`."""
        if self.kind == "library":
            return {place for name in self.truth["effects"] for place in self._acts_on(name)}
        if self.kind == "template":
            return {place for name in self.truth["accepted"] for place in self._place_of(name)}
        if self.kind == "parameter":
            return {self.truth["parameter"], *self.truth["places"]}
        return set()

    def _acts_on(self, effect):
        for line in self.effects[effect].read_text().splitlines():
            if line.startswith("add "):
                yield line.split("///")[0].split()[-1]
            elif line.startswith("replace "):
                found = re.match(r"replace (output )?(\w+)(?: in (\w+))? by", line)
                yield f"sensor {found[2]}" if found[1] else found[3] or found[2]

    def _place_of(self, name):
        """The equation that `name(target, …)` acts on, or its only target."""
        template, targets = name.rstrip(")").split("(")
        target = targets.split(",")[-1].strip()
        return [f"sensor {target}" if template.startswith("sensor") else target]


def run(dgd, *arguments, limit=None):
    """After so many seconds of a processor it is ended."""
    command = [dgd, *map(str, arguments), "--threads", "1", "--format", "json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False,
                          env={**os.environ, "OMP_NUM_THREADS": "1"},
                          preexec_fn=limit and partial(resource.setrlimit, resource.RLIMIT_CPU, (limit, limit)))
    try:
        return json.loads(done.stdout)
    except json.JSONDecodeError:
        return None


def table(path):
    """A recording: a frame with plain names, and the header's texts by those names."""
    frame = pd.read_csv(path, comment="#")
    header = {column.split(" [")[0]: column for column in frame.columns}
    frame.columns = list(header)
    return frame, header


def seconds_per_unit(header):
    return SECONDS[re.search(r"\[(.*)\]", header["time"])[1]]
