"""The tables of a PEtab problem, in either version."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from ..formula.expression import Expression, name


@dataclass(frozen=True)
class Parameter:
    """A row of the parameter table."""

    name: str
    doc: str
    value: float
    #: Lower and upper, where there are any.
    bounds: tuple[float | None, float | None]
    #: Whether its logarithm is estimated.
    is_log: bool
    is_estimated: bool
    #: The law of its prior, by the language's name for it, and the law's two numbers.
    prior: tuple[str, float, float] | None = None


@dataclass(frozen=True)
class Observable:
    """A row of the observable table."""

    name: str
    doc: str
    formula: Expression
    noise: Expression
    #: Names in the formulas that rows of the measurement table give values.
    placeholders: tuple[str, ...]
    noise_placeholders: tuple[str, ...]
    #: ``"lin"``, ``"log"`` or ``"log10"``: on which scale the noise is normal.
    scale: str = "lin"


#: In the place of a value: that of the model itself, in which a state goes on as it is.
OWN = name("value of the model")


@dataclass(frozen=True)
class Phase:
    """Values that apply from some time on, in the model's unit; the first phase gives initial values, too."""

    start: float
    values: dict[str, Expression]


@dataclass(frozen=True)
class Experiment:
    """Conditions under which measurements were made."""

    name: str
    #: One after the other, from 0 on.
    phases: tuple[Phase, ...]
    #: What has which value at the steady state in which the run starts; None where it starts from start values.
    before: dict[str, Expression] | None = None
    #: How long the first phase takes, which comes to that steady state; 0 where there is none.
    run_in: float = 0.0

    def settled(self, run_in: float) -> Experiment:
        """The experiment with a run-in of this length instead of a steady state."""
        if self.before is None:
            return self
        later = (Phase(run_in + phase.start, phase.values) for phase in self.phases)
        return Experiment(self.name, (Phase(0.0, self.before), *later), None, run_in)

    @property
    def targets(self) -> set[str]:
        """All changes made by a condition."""
        return set().union(self.before or (), *(phase.values for phase in self.phases))


@dataclass(frozen=True)
class Measurement:
    """A row of the measurement table."""

    observable: str
    experiment: str
    time: float
    value: float
    overrides: tuple[Expression, ...]
    noise_overrides: tuple[Expression, ...]


@dataclass
class Tables:
    """A problem: its model as libSBML has it, and its tables."""

    document: Any
    parameters: dict[str, Parameter] = field(default_factory=dict)
    observables: dict[str, Observable] = field(default_factory=dict)
    experiments: dict[str, Experiment] = field(default_factory=dict)
    #: In the order of the measurement table.
    measurements: list[Measurement] = field(default_factory=list)
    #: The measurement table as petab has it, a data frame of pandas.
    frame: Any = None

    def settle(self, run_in: float, rest: float | None) -> None:
        """Replaces pre-equilibration by a run-in, and a steady state at the end by a time at rest."""
        self.experiments = {which: one.settled(run_in) for which, one in self.experiments.items()}
        if rest is None:
            return
        last = {which: one.phases[-1].start - one.run_in for which, one in self.experiments.items()}
        for one in self.measurements:
            if math.isfinite(one.time):
                last[one.experiment] = max(last[one.experiment], one.time)
        self.measurements = [
            replace(one, time=last[one.experiment] + rest) if one.time == math.inf else one
            for one in self.measurements
        ]
