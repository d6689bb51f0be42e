"""Equations and residuals at single points, for SciPy and other solvers and optimisers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _dgd
from ._data.bytes import Array, array, packed

if TYPE_CHECKING:
    from typing_extensions import Self, TypeAlias

    from ._model.model import Model

#: The model, the name of its method, the recordings and the options of the call.
Again: "TypeAlias" = "tuple[Model, str, Any, dict[str, Any]]"


class _Again:
    """An immutable object that is pickled as the call that made it: optimisers copy their objectives."""

    def __init__(self, again: Again) -> None:
        self._again = again

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _made, self._again


def _made(model: Model, what: str, data: Any, options: dict[str, Any]) -> Any:
    return getattr(model, what)(data, **options)


class Problem(_Again):
    """The equations M dy/dt = f(t, y) of a model with the inputs of a recording, in declared units.

    >>> problem = m.problem(df)
    >>> scipy.integrate.solve_ivp(problem.rhs, problem.span, problem.y0, "LSODA", problem.times, jac=problem.jacobian)

    A model with modes is evaluated in those that it starts in. Where ``mass`` is 0, an equation is algebraic and SciPy
    does not solve it; its row of f is in SI units.
    """

    def __init__(self, native: _dgd.Equations, again: Again) -> None:
        super().__init__(again)
        self._native = native
        #: Names of y.
        self.names: list[str] = [name for name, _ in native.unknowns]
        #: Units of y.
        self.units: dict[str, str] = dict(native.unknowns)
        #: The diagonal of M.
        self.mass: Array = array(native.mass)
        #: Times of the recording, s since its first sample.
        self.times: Array = array(native.times)
        #: First and last of them.
        self.span: tuple[float, float] = (float(self.times[0]), float(self.times[-1]))

    @property
    def y0(self) -> Array:
        """Unknowns at the first time, which satisfy the algebraic equations."""
        return array(self._native.start())

    def rhs(self, t: float, y: Any) -> Array:
        """f, in the units of y over s."""
        return array(self._native.rhs(self._at(t, y)))

    def jacobian(self, t: float, y: Any) -> Array:
        """df/dy, a row for each equation."""
        n = len(self.names)
        return array(self._native.jacobian(self._at(t, y))).reshape(n, n)

    def parameter_jacobian(self, t: float, y: Any) -> Array:
        """df/dp, a row for each equation and a column for each parameter of the model."""
        return array(self._native.parameter_jacobian(self._at(t, y))).reshape(len(self.names), -1)

    def inputs(self, t: float) -> dict[str, float]:
        """Inputs at a time."""
        values = array(self._native.inputs_at(t)).tolist()
        return dict(zip((name for name, _ in self._native.inputs), values, strict=True))

    def outputs(self, t: float, y: Any) -> dict[str, float]:
        """Outputs at a time and place."""
        values = array(self._native.outputs_at(self._at(t, y))).tolist()
        return dict(zip((name for name, _ in self._native.outputs), values, strict=True))

    @staticmethod
    def _at(t: float, y: Any) -> tuple[float, bytes, None, None]:
        return (t, packed(y), None, None)

    def __repr__(self) -> str:
        return f"<dgd.Problem in {', '.join(self.names)} over {self.span[0]:g} … {self.span[1]:g} s>"


class Objective(_Again):
    """The objective of a fit: half the sum of squares of ``residuals``, as a function of ``x`` in declared units.

    Residuals are (simulated - measured) / noise of all samples, and (p - mean) / std of priors. The objective is the
    negative logarithm of the likelihood but for a constant.

    >>> o = m.objective([df])
    >>> scipy.optimize.least_squares(o.residuals, o.x0, o.jacobian, o.bounds)
    >>> pypesto.Objective(fun=o, grad=o.gradient, hess=o.hessian, res=o.residuals, sres=o.jacobian)
    """

    def __init__(self, native: _dgd.Objective, again: Again) -> None:
        super().__init__(again)
        self._native = native
        variables = native.variables
        #: What x is: parameters by name, start values as ``x(0)``.
        self.names: list[str] = [variable[0] for variable in variables]
        self.units: dict[str, str] = {variable[0]: variable[1] for variable in variables}
        #: First guess.
        self.x0: Array = np.array([variable[2] for variable in variables])
        #: Lower and upper bounds, infinite where there are none.
        self.bounds: tuple[Array, Array] = (
            np.array([variable[3] for variable in variables]),
            np.array([variable[4] for variable in variables]),
        )
        #: Names of what is better searched for by its logarithm.
        self.logarithmic: list[str] = [variable[0] for variable in variables if variable[5]]

    def residuals(self, x: Any) -> Array:
        """The residuals."""
        return array(self._native.residuals(packed(x)))

    def jacobian(self, x: Any) -> Array:
        """Their derivatives, a column for each of ``names``."""
        _, rows = self._native.linearised(packed(x))
        return array(rows).reshape(-1, len(self.names))

    def __call__(self, x: Any) -> float:
        """Half the sum of squares of the residuals."""
        residuals = self.residuals(x)
        return 0.5 * float(residuals @ residuals)

    def gradient(self, x: Any) -> Array:
        """Its gradient."""
        residuals, rows = map(array, self._native.linearised(packed(x)))
        gradient: Array = rows.reshape(-1, len(self.names)).T @ residuals
        return gradient

    def hessian(self, x: Any) -> Array:
        """Its Gauss–Newton Hessian, from first derivatives of the residuals."""
        jacobian = self.jacobian(x)
        hessian: Array = jacobian.T @ jacobian
        return hessian

    def __repr__(self) -> str:
        return f"<dgd.Objective of {', '.join(self.names)}>"
