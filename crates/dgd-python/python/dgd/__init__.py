"""Models in a small equation language: simulates, differentiates and fits them, and searches for missing effects.

>>> import dgd
>>> m = dgd.load("m.dgd", variant={"flow": "static"})
>>> r = m.simulate(df, params={"c0": 280}, start={"h_r": 48})
>>> r["p_r"], r.units["p_r"], r.to_pandas()

A model that has mistakes raises :class:`ModelError`, a recording :class:`DataError`; all exceptions are
:class:`DgdError`. Every number is in the unit that the model declares for it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._dgd import __version__

if TYPE_CHECKING:
    from ._model.declared import Quantity
    from ._errors import (
        DataError,
        DgdError,
        DgdWarning,
        Diagnostic,
        FitError,
        InternalError,
        ModelError,
        Place,
        SimulationError,
        UsageError,
    )
    from ._fleet.fleet import Fleet, fleet
    from ._fleet.listing import Piece
    from ._model.model import Model, load, parse
    from ._petab.problem import PetabProblem, from_petab
    from ._points import Objective, Problem
    from ._results.discovery import Discovery, Effect
    from ._results.fit import Fit, Interval
    from ._results.series import Sensitivity, Simulation
    from ._show.report import Report
    from ._track import Estimates, Tracked, Tracker

# What is loaded when it is first asked for: the command needs none of it, nor NumPy.
_PLACES = {
    "DataError": "_errors",
    "DgdError": "_errors",
    "DgdWarning": "_errors",
    "Diagnostic": "_errors",
    "FitError": "_errors",
    "InternalError": "_errors",
    "ModelError": "_errors",
    "Place": "_errors",
    "SimulationError": "_errors",
    "UsageError": "_errors",
    "Fleet": "_fleet.fleet",
    "Piece": "_fleet.listing",
    "fleet": "_fleet.fleet",
    "Model": "_model.model",
    "Quantity": "_model.declared",
    "load": "_model.model",
    "parse": "_model.model",
    "PetabProblem": "_petab.problem",
    "from_petab": "_petab.problem",
    "Objective": "_points",
    "Problem": "_points",
    "Discovery": "_results.discovery",
    "Effect": "_results.discovery",
    "Fit": "_results.fit",
    "Interval": "_results.fit",
    "Sensitivity": "_results.series",
    "Simulation": "_results.series",
    "Report": "_show.report",
    "Estimates": "_track",
    "Tracked": "_track",
    "Tracker": "_track",
}

__all__ = [
    "DataError",
    "DgdError",
    "DgdWarning",
    "Diagnostic",
    "Discovery",
    "Effect",
    "Estimates",
    "Fit",
    "FitError",
    "Fleet",
    "InternalError",
    "Interval",
    "Model",
    "ModelError",
    "Objective",
    "PetabProblem",
    "Piece",
    "Place",
    "Problem",
    "Quantity",
    "Report",
    "Sensitivity",
    "Simulation",
    "SimulationError",
    "Tracked",
    "Tracker",
    "UsageError",
    "__version__",
    "fleet",
    "from_petab",
    "load",
    "parse",
]


def __getattr__(name: str) -> Any:
    place = _PLACES.get(name)
    if place is None:
        raise AttributeError(f"module 'dgd' has no attribute {name!r}")
    value = getattr(import_module(f".{place}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


def load_ipython_extension(ipython: Any) -> None:
    """Gives a notebook the cell magic ``%%dgd``: ``%load_ext dgd``."""
    from ._show.magic import register

    register(ipython)
