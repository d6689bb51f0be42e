"""Exceptions, and their construction from errors of the native module."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._dgd import __version__

if TYPE_CHECKING:
    from ._results.series import Sensitivity, Simulation


@dataclass(frozen=True)
class Place:
    """A place in a text. Lines and columns count from 1; the end column is the one behind the last character."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int
    text: str


@dataclass(frozen=True)
class Diagnostic:
    """An error: its code for ``dgd explain``, message, position, and remedy."""

    code: str
    message: str
    places: tuple[Place, ...]
    help: str | None

    @property
    def span(self) -> Place | None:
        """The primary position."""
        return self.places[0] if self.places else None


class DgdError(Exception):
    """Base class of all exceptions of dgd."""

    #: The mistakes that have a place in a text.
    diagnostics: tuple[Diagnostic, ...] = ()


class ModelError(DgdError):
    """A model, an effect or a library has errors; ``diagnostics`` lists them."""


class DataError(DgdError):
    """A recording or a file cannot be used; ``diagnostics`` lists the errors that have a position."""


class UsageError(DgdError, ValueError):
    """An invalid call: a name that is not in the model, or options that exclude each other."""

    #: The first argument that the message names, if any.
    argument: str | None = None


class SimulationError(DgdError):
    """A run stopped early; ``partial`` has the results so far, if there are any."""

    partial: Simulation | Sensitivity | None = None


class FitError(DgdError):
    """The model could not be evaluated at any point."""


class InternalError(DgdError):
    """A bug in dgd: please report it."""


class DgdWarning(UserWarning):
    """A remark about a result."""


def warn(remarks: Iterable[str], stacklevel: int = 2) -> None:
    """Issues a warning for each remark; identical ones only once."""
    for words in dict.fromkeys(remarks):
        warnings.warn(words.removeprefix("note: "), DgdWarning, stacklevel=stacklevel + 1)


def _diagnostic(entry: dict[str, Any]) -> Diagnostic:
    places = tuple(Place(**place) for place in entry["places"])
    return Diagnostic(entry["code"], entry["message"], places, entry["help"])


_KINDS: dict[str, type[DgdError]] = {
    "usage": UsageError,
    "model": ModelError,
    "data": DataError,
    "fit": FitError,
    "simulation": SimulationError,
}


def of_work(
    kind: str, message: str, argument: str | None, mistakes: str, without_unit: list[str]
) -> DgdError:
    """The exception of this kind; ``without_unit`` names columns of a frame that need a unit."""
    if without_unit:
        message = _with_units(message, without_unit)
    error = _KINDS[kind](message)
    if isinstance(error, UsageError):
        error.argument = argument
    error.diagnostics = tuple(_diagnostic(entry) for entry in json.loads(mistakes))
    return error


def _with_units(text: str, names: list[str]) -> str:
    """Explains how to give units to a frame."""
    given = ", ".join(f'"{name}": "…"' for name in names)
    return f'{text}\n  or give `units={{{given}}}`, or `units="declared"` where all are in the model\'s units'


def internal(words: str) -> InternalError:
    """The exception for a bug in dgd."""
    return InternalError(
        "dgd has made a mistake; please report it with the call, the model, the data and this line: "
        f"dgd {__version__}, {words}"
    )
