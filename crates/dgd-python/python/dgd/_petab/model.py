"""The model to be written, and its layout."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from .formula.expression import Expression
from .names import Names
from .read.tables import Parameter

# Units of time, s, by their names in the language.
_TIMES = {1.0: "s", 60.0: "min", 3600.0: "h", 86400.0: "d", 604800.0: "week"}


@dataclass(frozen=True)
class State:
    """A state: its initial value, and its rate in the model's unit of time."""

    start: Expression
    rate: Expression
    doc: str


@dataclass(eq=False)
class Output:
    """An observable with one set of overrides."""

    name: str
    doc: str
    formula: Expression
    #: None where a fit estimates the noise.
    noise: Expression | None
    #: ``"lin"``, or the logarithm that the output and its readings are taken of.
    scale: str


@dataclass
class Written:
    """The contents of the model, in names of the problem."""

    name: str
    doc: str
    #: s
    time_unit: float
    constants: dict[str, tuple[Expression, str]] = field(default_factory=dict)
    inputs: dict[str, str] = field(default_factory=dict)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    lets: dict[str, tuple[Expression, str]] = field(default_factory=dict)
    states: dict[str, State] = field(default_factory=dict)
    outputs: list[Output] = field(default_factory=list)
    #: What states are set to where a phase begins, by its number.
    resets: dict[int, dict[str, Expression]] = field(default_factory=dict)
    #: The number of the phase, where anything is set.
    phase: Expression | None = None
    #: Whether a run starts at rest, under the first conditions of its experiment.
    is_steady: bool = False
    #: The output of each measurement.
    places: list[Output] = field(default_factory=list)
    #: Values of inputs, by experiment and phase.
    columns: dict[tuple[str, int], dict[str, float]] = field(default_factory=dict)
    names: Names = field(default_factory=Names)
    #: Names of the unit of time, and of the time in it.
    unit_name: str = ""
    time_name: str = ""

    @property
    def time_label(self) -> tuple[str, float]:
        """The time unit of recordings, and the size of the model's unit in it."""
        label = _TIMES.get(self.time_unit)
        return ("s", self.time_unit) if label is None else (label, 1.0)

    def text(self) -> str:
        """The model's text."""
        label, size = self.time_label
        said = self.names.of
        blocks = [
            [f"model {said(self.name)}"],
            [f"constant {self.unit_name} [{label}] = {_plain(size)}  /// of the model's time"],
            [f"constant {said(one)} = {value}{_doc(doc)}" for one, (value, doc) in self.constants.items()],
            [f"input {said(one)}{_doc(doc)}" for one, doc in self.inputs.items()],
            [self._parameter(one) for one in self.parameters.values()],
            [f"let {said(one)} = {self._said(value)}{_doc(doc)}" for one, (value, doc) in self.lets.items()],
            [f"state {said(one)} = {self._said(is_.start)}  fixed{_doc(is_.doc)}" for one, is_ in self.states.items()],
            [
                f"equation {said(one)}: {self.unit_name}*der({said(one)}) = {self._said(is_.rate)}"
                for one, is_ in self.states.items()
            ],
            ["start steady"] if self.is_steady else [],
            [self._when(k, resets) for k, resets in self.resets.items()],
            [self._output(one) for one in self.outputs],
        ]
        about = f"/// {self.doc}\n" if self.doc else ""
        return about + "\n\n".join("\n".join(block) for block in blocks if block) + "\n"

    def _said(self, formula: Expression) -> str:
        return str(formula.renamed(self.names.of))

    def _parameter(self, one: Parameter) -> str:
        attributes = []
        lower, upper = map(_finite, one.bounds)
        if one.is_estimated and (lower or upper):
            attributes.append(f"in {lower} .. {upper}".replace("in  ", "in ").rstrip())
        if one.is_log:
            attributes.append("log")
        if not one.is_estimated:
            attributes.append("fixed")
        if one.prior is not None:
            law, first, second = one.prior
            attributes.append(f"prior {law}({_plain(first)}, {_plain(second)})")
        return f"parameter {self.names.of(one.name)} = {_plain(one.value)}  {', '.join(attributes)}{_doc(one.doc)}"

    def _when(self, k: int, resets: dict[str, Expression]) -> str:
        assert self.phase is not None
        lines = [f"  reset {self.names.of(one)} = {self._said(formula)}" for one, formula in resets.items()]
        return "\n".join([f"when {self._said(self.phase)} rises above {k - 0.5} {{", *lines, "}"])

    def _output(self, one: Output) -> str:
        formula = self._said(one.formula)
        if one.scale != "lin":
            formula = f"{'log10' if one.scale == 'log10' else 'log'}({formula})"
        noise = "" if one.noise is None else f"  noise {self._said(one.noise)}"
        return f"output {one.name} [1] = {formula}{noise}{_doc(one.doc)}"


def _plain(value: float) -> str:
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def _finite(value: float | None) -> str:
    return "" if value is None or math.isinf(value) else _plain(value)


def _doc(words: str) -> str:
    return f"  /// {words}" if words else ""
