"""Differences between experiments, as inputs of the model that are constant over a recording."""

from __future__ import annotations

from .formula.expression import Expression, name, operation, total
from .model import Written


#: An experiment, and which of its phases.
Key = tuple[str, int]


def as_number(formula: Expression) -> float | None:
    """The value of a number with or without a sign."""
    if formula.kind == "number":
        return formula.value
    if formula.kind == "minus" and formula.parts[0].kind == "number":
        return -formula.parts[0].value
    return None


class Conditions:
    """Makes one formula of the values of a quantity in all experiments and phases."""

    def __init__(self, written: Written, keys: list[Key]) -> None:
        self._written, self._keys = written, keys
        self._indicators: dict[Key, str] = {}

    def formula(self, which: str, values: dict[Key, Expression], doc: str) -> Expression:
        """The formula of a quantity by its value in each phase.

        It is the value, if all have the same; an input called ``which``, if all are numbers; and
        otherwise a sum over phases, each with an input that is 1 in this phase and 0 in the others.
        """
        distinct = list(dict.fromkeys(values.values()))
        if len(distinct) == 1:
            return distinct[0]
        numbers = {key: as_number(value) for key, value in values.items()}
        if None not in numbers.values():
            self._input(which, {one: value or 0.0 for one, value in numbers.items()}, doc)
            return name(which)
        terms = []
        for value in distinct:
            members = [one for one in self._keys if values.get(one) == value]
            shares = [name(self._indicator(one)) for one in members] if as_number(value) != 0 else []
            if shares:
                factors = [value, total(shares)] if as_number(value) is not None else [total(shares), value]
                terms.append(operation("*", *factors))
        return total(terms)

    def phase(self) -> Expression:
        """An input that is the number of the phase, from 0."""
        which = self._written.names.fresh("phase")
        self._input(which, {key: float(key[1]) for key in self._keys}, "how often the conditions have changed")
        return name(which)

    def _indicator(self, key: Key) -> str:
        if key not in self._indicators:
            experiment, phase = key
            which = self._written.names.fresh(f"in_{experiment}" + (f"_{phase + 1}" if phase else ""))
            self._indicators[key] = which
            columns = {one: float(one == key) for one in self._keys}
            self._input(which, columns, f"1 in the experiment {experiment}, 0 in the others")
        return self._indicators[key]

    def _input(self, which: str, columns: dict[Key, float], doc: str) -> None:
        self._written.inputs[which] = doc
        for key in self._keys:
            # What is there from the start on keeps its value; what is only read when a phase begins has none before.
            self._written.columns[key][which] = columns.get(key, columns.get((key[0], 0), 0.0))
