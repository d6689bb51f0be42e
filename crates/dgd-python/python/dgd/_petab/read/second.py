"""Problems of PEtab version 2, read by petab."""

from __future__ import annotations

import math
from typing import Any

from ..formula.expression import ZERO, Expression
from ..formula.mathml import of_petab
from ..refusal import Refusals, Refused
from .priors import Bounds, nominal, prior
from .tables import Experiment, Measurement, Observable, Parameter, Phase, Tables


def tables(problem: Any, refusals: Refusals) -> Tables:
    """The tables of a problem of petab."""
    return _Reader(problem, refusals).read()


class _Reader:
    """Reads the tables."""

    def __init__(self, problem: Any, refusals: Refusals) -> None:
        self._problem, self._refusals = problem, refusals
        self._conditions = {one.id: one for one in problem.conditions}
        for one in problem.mappings:
            refusals.add(f"`{one.petab_id}` of the mapping table")
        if len(problem.models) != 1:
            refusals.add(f"{len(problem.models)} models in one problem")
        for extension in problem.config.extensions if problem.config else ():
            refusals.add(f"the extension `{extension}`")

    def read(self) -> Tables:
        """All of them."""
        problem = self._problem
        tables = Tables(problem.models[0].sbml_document)
        tables.parameters = {one.id: self._parameter(one) for one in problem.parameters}
        tables.observables = {one.id: self._observable(one) for one in problem.observables}
        known = {one.id: one for one in problem.experiments}
        tables.frame = problem.measurement_df.reset_index(drop=True)
        for one in problem.measurements:
            which = one.experiment_id or "model"
            if which not in tables.experiments:
                periods = known[which].sorted_periods if which in known else []
                tables.experiments[which] = self._experiment(which, periods)
            tables.measurements.append(self._measurement(one, which))
        return tables

    def _parameter(self, one: Any) -> Parameter:
        bounds: Bounds = (one.lb, one.ub)
        law = None
        if one.estimate and one.prior_distribution is not None:
            kind = getattr(one.prior_distribution, "value", str(one.prior_distribution))
            law, bounds = prior(one.id, kind, one.prior_parameters, "lin", bounds, self._refusals)
        # This version leaves the scale to the tool.
        is_log = one.estimate and bounds[0] is not None and bounds[0] > 0
        value = nominal(one.id, one.nominal_value, bounds, is_log, self._refusals)
        return Parameter(one.id, "", value, bounds, is_log, one.estimate, law)

    def _observable(self, one: Any) -> Observable:
        distribution = getattr(one.noise_distribution, "value", str(one.noise_distribution))
        if distribution not in ("normal", "log-normal"):
            self._refusals.add(f"noise distribution `{distribution}` of observable `{one.id}`")
        return Observable(
            one.id,
            one.name or "",
            self._formula(one.formula, f"observable `{one.id}`"),
            self._formula(one.noise_formula, f"the noise of observable `{one.id}`"),
            tuple(map(str, one.observable_placeholders)),
            tuple(map(str, one.noise_placeholders)),
            "log" if distribution == "log-normal" else "lin",
        )

    def _experiment(self, which: str, periods: list[Any]) -> Experiment:
        """An experiment. Its changes last until another one."""
        before, phases = None, []
        for period in periods:
            values: dict[str, Expression] = {}
            for condition in period.condition_ids:
                for change in self._conditions[condition].changes:
                    values[change.target_id] = self._formula(change.target_value, f"condition `{condition}`")
            if math.isinf(period.time):
                before = values
            else:
                phases.append(Phase(period.time, values))
        if phases and phases[0].start != 0:
            self._refusals.add(f"the experiment `{which}`, which starts at the time {phases[0].start:g} and not at 0")
        return Experiment(which, tuple(phases) or (Phase(0.0, {}),), before)

    def _measurement(self, one: Any, experiment: str) -> Measurement:
        return Measurement(
            one.observable_id,
            experiment,
            one.time,
            one.measurement,
            tuple(self._formula(value, "the measurement table") for value in one.observable_parameters),
            tuple(self._formula(value, "the measurement table") for value in one.noise_parameters),
        )

    def _formula(self, written: Any, of: str) -> Expression:
        """A formula of sympy; zero where it is refused."""
        from petab.v1.math import petab_math_str

        try:
            return of_petab(petab_math_str(written))
        except Refused as error:
            self._refusals.add(f"{error} of {of}")
            return ZERO
