"""Observables as outputs: one for each set of overrides in the measurement table."""

from __future__ import annotations

from .formula.evaluate import constant
from .formula.expression import ONE, Expression, call, number, operation
from .model import Output
from .names import Names
from .read.tables import Measurement, Observable, Tables
from .refusal import Refusals

Overrides = tuple[tuple[Expression, ...], tuple[Expression, ...]]


def outputs(
    tables: Tables, names: Names, constants: dict[str, Expression], is_noise_declared: bool, refusals: Refusals
) -> tuple[list[Output], list[Output]]:
    """The outputs, in the order of the observable table, and that of each measurement.

    ``constants`` has values that are not estimated, and are equal in all experiments.
    """
    fixed = {one.name: number(one.value) for one in tables.parameters.values() if not one.is_estimated} | constants
    maker = _Maker(names, is_noise_declared, fixed, refusals)
    sets: dict[str, dict[Overrides, Output]] = {}
    for observable in tables.observables.values():
        rows = [one for one in tables.measurements if one.observable == observable.name]
        distinct = list(dict.fromkeys(map(_overrides, rows)))
        sets[observable.name] = maker.outputs(observable, distinct)
    found = [one for of_one in sets.values() for one in of_one.values()]
    places = []
    for measurement in tables.measurements:
        if measurement.observable not in sets:
            refusals.add(f"measurements of `{measurement.observable}`, which is no observable")
            continue
        places.append(sets[measurement.observable][_overrides(measurement)])
    return found, places


def _overrides(measurement: Measurement) -> Overrides:
    return measurement.overrides, measurement.noise_overrides


class _Maker:
    """Makes outputs, each with a name of its own."""

    def __init__(
        self, names: Names, is_noise_declared: bool, fixed: dict[str, Expression], refusals: Refusals
    ) -> None:
        self._names = names
        self._is_noise_declared, self._fixed, self._refusals = is_noise_declared, fixed, refusals

    def outputs(self, observable: Observable, distinct: list[Overrides]) -> dict[Overrides, Output]:
        """The outputs of an observable. If it is not measured, it has one, provided its formula is complete."""
        is_measured = bool(distinct)
        if not is_measured and not observable.placeholders:
            distinct = [((), ())]
        scale = self._scale(observable)
        bare = observable.name if scale == "lin" else f"{scale}_{observable.name}"
        counted = [bare] if len(distinct) == 1 else [f"{bare}_{k}" for k in range(1, len(distinct) + 1)]
        return {
            overrides: self._output(observable, overrides, self._names.fresh(which), is_measured)
            for overrides, which in zip(distinct, counted, strict=True)
        }

    def _output(self, observable: Observable, overrides: Overrides, which: str, is_measured: bool) -> Output:
        by: dict[str, Expression] = {}
        noise_wanted = observable.noise_placeholders
        for given, wanted in zip(overrides, (observable.placeholders, noise_wanted)):
            is_needed = wanted is not noise_wanted or (is_measured and self._is_noise_declared) or given
            if is_needed and len(given) < len(wanted):
                self._refusals.add(f"measurements of `{observable.name}` without a value of `{wanted[-1]}`")
            by.update(zip(wanted, given))
        # What is not measured needs no noise.
        is_said = is_measured or not noise_wanted
        noise = self._noise(observable, observable.noise.replaced(by)) if is_said else None
        said = ", ".join(f"{one} = {value}" for one, value in by.items())
        doc = "; ".join(words for words in (observable.doc, said if len(by) else "") if words)
        return Output(which, doc, observable.formula.replaced(by), noise, self._scale(observable))

    def _scale(self, observable: Observable) -> str:
        """The logarithm applied to the output: none, if the noise can be log-normal."""
        return "lin" if self._is_noise_declared else observable.scale

    def _noise(self, observable: Observable, noise: Expression) -> Expression | None:
        if not self._is_noise_declared:
            return None
        value = constant(noise.replaced(self._fixed))
        said = noise if value is None else number(value)
        if self._scale(observable) == observable.scale:
            return said
        # The deviation of the natural logarithm.
        factor = call("log", number(10)) if observable.scale == "log10" else ONE
        return call("lognormal", operation("*", factor, said))
