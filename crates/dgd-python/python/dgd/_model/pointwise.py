"""A model evaluated point by point: its equations, and the objective of a fit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _dgd
from .._data.bytes import Array, array, packed
from .._data.incoming import recording
from .._errors import UsageError
from .._options import Names, Start, Values, names, native
from .._points import Again, Objective, Problem
from .asked import Asked, arguments

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import RunOptions
    from .model import Model


class Pointwise(Asked):
    """A model that can be evaluated at single points."""

    def __init__(self, native_model: _dgd.Model) -> None:
        super().__init__(native_model)
        self._plain: _dgd.Equations | None = None

    def problem(
        self, data: Any = None, *, params: Values = None, start: Start = None, **run: Unpack[RunOptions]
    ) -> Problem:
        """The equations with the inputs of a recording, point by point: ``rhs``, ``jacobian``, ``y0``, for SciPy."""
        given = self._recording(data, run)
        found = self._native.point_by_point(given.argument if given else None, native(run, params, start))
        return Problem(found, self._again("problem", data, params=params, start=start, **run))

    def rhs(
        self, t: float, y: Any, inputs: Mapping[str, float] | None = None, params: Mapping[str, float] | None = None
    ) -> Array:
        """f of the equations M dy/dt = f(t, y, u, p), in declared units; ``y`` is in the order of ``unknowns``.

        ``inputs`` has a number for each input. For inputs that change over time, use :meth:`problem`.
        """
        equations, u, p = self._at(inputs, params)
        return array(equations.rhs((t, packed(y), u, p)))

    def jacobian(
        self, t: float, y: Any, inputs: Mapping[str, float] | None = None, params: Mapping[str, float] | None = None
    ) -> Array:
        """df/dy, a row for each equation; the rest as for :meth:`rhs`."""
        equations, u, p = self._at(inputs, params)
        n = len(equations.unknowns)
        return array(equations.jacobian((t, packed(y), u, p))).reshape(n, n)

    @property
    def unknowns(self) -> dict[str, str]:
        """Names and units of y of :meth:`rhs`, elements of arrays included."""
        return dict(self._equations(dict.fromkeys(self.inputs, 0.0)).unknowns)

    def objective(
        self,
        data: Any,
        *,
        free: Names = (),
        fix: Names = (),
        outputs: Names = (),
        noise: Mapping[str, float] | None = None,
        params: Values = None,
        start: Start = None,
        **run: Unpack[RunOptions],
    ) -> Objective:
        """The objective of a fit as a function of the estimates: for SciPy, pyPESTO and samplers.

        ``noise`` has standard deviations of outputs in their units, instead of the declared ones.
        """
        options = native(run, params, start, free=names(free), fix=names(fix), outputs=names(outputs), noise="declared")
        train, _ = self._recordings(data, None, run)
        sigma = [(name, float(value)) for name, value in (noise or {}).items()]
        found = self._native.objective(arguments(train), sigma, options)
        given = dict(free=free, fix=fix, outputs=outputs, noise=noise, params=params, start=start)
        return Objective(found, self._again("objective", data, **given, **run))

    def _again(self, what: str, data: Any, **options: Any) -> Again:
        """A call that can be repeated."""
        if TYPE_CHECKING:
            assert isinstance(self, Model)
        return self, what, data, options

    def _at(
        self, inputs: Mapping[str, float] | None, params: Mapping[str, float] | None
    ) -> tuple[_dgd.Equations, bytes | None, bytes | None]:
        """The equations, and inputs and parameters in their order."""
        equations = self._equations(inputs)
        p = _by_name(equations.parameters, params, array(equations.parameter_values)) if params else None
        return equations, _by_name(equations.inputs, inputs, None), p

    def _equations(self, inputs: Mapping[str, float] | None) -> _dgd.Equations:
        """The equations at constant inputs, which each call sets."""
        if self._plain is None:
            constant = None
            if self.inputs:
                values = {f"{one.name} [{one.unit}]": [(inputs or {}).get(one.name, 0.0)] for one in self.inputs.values()}
                constant = recording({"time [s]": [0.0], **values}, None, {}, "inputs").argument
            self._plain = self._native.point_by_point(constant, native({}, None, None))
        if self.inputs and inputs is None:
            raise UsageError("the model has inputs: `inputs={" + ", ".join(f'"{name}": …' for name in self.inputs) + "}`")
        return self._plain


def _by_name(known: list[tuple[str, str]], asked: Mapping[str, float] | None, standard: Array | None) -> bytes | None:
    """Numbers by name in the order of the names; default values for missing ones."""
    if not known or asked is None:
        return None
    order = [name for name, _ in known]
    for name in asked:
        if name not in order:
            raise UsageError(f"there is no `{name}`; there is `" + "`, `".join(order) + "`")
    missing = [name for name in order if name not in asked]
    if missing and standard is None:
        raise UsageError("there is no value of `" + "`, `".join(missing) + "`")
    values = np.zeros(len(order)) if standard is None else standard.copy()
    for name, value in asked.items():
        values[order.index(name)] = float(value)
    return packed(values)
