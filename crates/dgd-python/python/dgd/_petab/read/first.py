"""Problems of PEtab version 1, read with petab."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from ..._errors import DataError
from ..formula.expression import ZERO, Expression
from ..formula.mathml import of_petab
from ..refusal import Refusals, Refused
from .priors import Bounds, nominal, prior
from .tables import OWN, Experiment, Measurement, Observable, Parameter, Phase, Tables

_PLACEHOLDER = r"\b{}Parameter(\d+)_{}\b"


def tables(problem: Any, refusals: Refusals) -> Tables:
    """The tables of a problem of petab."""
    return _Reader(problem, refusals).read()


def is_missing(cell: object) -> bool:
    """Whether a cell of a table is empty."""
    return cell is None or cell == "" or (isinstance(cell, float) and math.isnan(cell)) or str(cell).lower() == "nan"


class _Reader:
    """Reads the tables."""

    def __init__(self, problem: Any, refusals: Refusals) -> None:
        self._problem, self._refusals = problem, refusals
        self._tables = Tables(problem.model.sbml_document)

    def read(self) -> Tables:
        """All of them."""
        problem, tables = self._problem, self._tables
        if getattr(problem, "mapping_df", None) is not None:
            self._refusals.add("the mapping table")
        for extension in getattr(problem, "extensions_config", None) or ():
            self._refusals.add(f"the extension `{extension}`")
        for which, row in problem.parameter_df.iterrows():
            tables.parameters[str(which)] = self._parameter(str(which), row)
        for which, row in problem.observable_df.iterrows():
            tables.observables[str(which)] = self._observable(str(which), row)
        tables.frame = problem.measurement_df.reset_index(drop=True)
        for _, row in tables.frame.iterrows():
            tables.measurements.append(self._measurement(row))
        return tables

    def _parameter(self, which: str, row: Mapping[str, Any]) -> Parameter:
        scale = row.get("parameterScale", "lin")
        of = f"parameter `{which}`"
        is_estimated = bool(_number(row["estimate"], of))
        bounds: Bounds = (_number(row.get("lowerBound"), of), _number(row.get("upperBound"), of))
        is_log = scale in ("log", "log10")
        value = nominal(which, _number(row.get("nominalValue"), of), bounds, is_log, self._refusals)
        kind, numbers = row.get("objectivePriorType"), row.get("objectivePriorParameters")
        law = None
        if is_estimated and not is_missing(kind):
            given = [] if is_missing(numbers) else [_number(one, of) or 0.0 for one in str(numbers).split(";")]
            law, bounds = prior(which, str(kind), given, str(scale), bounds, self._refusals)
        doc = _doc(row.get("parameterName"), which)
        return Parameter(which, doc, value, bounds, is_log and (is_estimated or value > 0), is_estimated, law)

    def _observable(self, which: str, row: Mapping[str, Any]) -> Observable:
        distribution = row.get("noiseDistribution")
        if not is_missing(distribution) and distribution != "normal":
            self._refusals.add(f"noise distribution `{distribution}` of observable `{which}`")
        scale = row.get("observableTransformation")
        noise = str(row["noiseFormula"])
        formula = str(row["observableFormula"])
        return Observable(
            which,
            _doc(row.get("observableName"), which),
            self.formula(formula, f"observable `{which}`"),
            self.formula(noise, f"the noise of observable `{which}`"),
            _placeholders("observable", which, f"{formula} {noise}"),
            _placeholders("noise", which, f"{formula} {noise}"),
            "lin" if is_missing(scale) else str(scale),
        )

    def _measurement(self, row: Mapping[str, Any]) -> Measurement:
        before, during = row.get("preequilibrationConditionId"), str(row["simulationConditionId"])
        experiment = during if is_missing(before) else f"{before}_then_{during}"
        if experiment not in self._tables.experiments:
            start = None if is_missing(before) else self._condition(str(before))
            # What the second condition leaves out is the model's again.
            values = dict.fromkeys(start or (), OWN) | self._condition(during)
            self._tables.experiments[experiment] = Experiment(experiment, (Phase(0.0, values),), start)
        return Measurement(
            str(row["observableId"]),
            experiment,
            _number(row["time"], "the measurement table") or 0.0,
            _measured(_number(row["measurement"], "the measurement table")),
            self._overrides(row.get("observableParameters")),
            self._overrides(row.get("noiseParameters")),
        )

    def _condition(self, which: str) -> dict[str, Expression]:
        """The values set by a condition, without those left to the model."""
        conditions = self._problem.condition_df
        if which not in conditions.index:
            raise DataError(f"the measurement table has the condition `{which}`, which the condition table has not")
        row = conditions.loc[which]
        cells = {str(target): cell for target, cell in row.items() if target != "conditionName"}
        return {
            target: self.formula(cell, f"condition `{which}`")
            for target, cell in cells.items()
            if not is_missing(cell)
        }

    def _overrides(self, cell: object) -> tuple[Expression, ...]:
        if is_missing(cell):
            return ()
        return tuple(self.formula(one.strip(), "the measurement table") for one in str(cell).split(";"))

    def formula(self, written: object, of: str) -> Expression:
        """A formula; zero if it is refused."""
        try:
            return of_petab(written)
        except Refused as error:
            self._refusals.add(f"{error} of {of}")
            return ZERO


def _number(cell: object, of: str) -> float | None:
    """The number in a cell; None if there is none."""
    try:
        return None if is_missing(cell) else float(str(cell))
    except ValueError:
        raise DataError(f"`{cell}` is not a number, in {of}") from None


def _measured(value: float | None) -> float:
    return math.nan if value is None else value


def _doc(words: object, name: str) -> str:
    said = "" if is_missing(words) else " ".join(str(words).split())
    return "" if said == name else said


def _placeholders(kind: str, observable: str, formulas: str) -> tuple[str, ...]:
    found = re.findall(_PLACEHOLDER.format(kind, re.escape(observable)), formulas)
    count = max(map(int, found), default=0)
    return tuple(f"{kind}Parameter{k}_{observable}" for k in range(1, count + 1))
