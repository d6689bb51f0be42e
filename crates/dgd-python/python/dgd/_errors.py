"""Exceptions, and their construction from errors of the native module."""

from __future__ import annotations

import json
import re
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


class SimulationError(DgdError):
    """A run stopped early; ``partial`` has the results so far, if there are any."""

    partial: Simulation | Sensitivity | None = None


class FitError(DgdError):
    """The model could not be evaluated at any point."""


class InternalError(DgdError):
    """A bug in dgd: please report it."""


class DgdWarning(UserWarning):
    """A remark about a result."""


# Words of the command line that are called otherwise here.
_RENAMED = {"set": "params", "from": "from_"}
_OPTION = re.compile(r"`--([a-z][a-z-]*)(?:[ =]([^`]*))?`")
_PLACE = re.compile(r"\(--([a-z][a-z-]*)\)")


def _argument(option: str) -> str:
    name = option.replace("-", "_")
    return _RENAMED.get(name, name)


def pythonic(words: str) -> str:
    """Words that name options of the command line, with arguments in their place: `--until T` is `until=T`."""

    def replaced(found: re.Match[str]) -> str:
        name, value = _argument(found[1]), found[2]
        if value is None:
            return f"`{name}`"
        return f'`{name}="{value}"`' if value.islower() else f"`{name}={value}`"

    words = _OPTION.sub(replaced, words)
    return _PLACE.sub(lambda found: f"({_argument(found[1])})", words)


def warn(remarks: Iterable[str], stacklevel: int = 2) -> None:
    """Issues a warning for each remark; identical ones only once."""
    for words in dict.fromkeys(remarks):
        words = pythonic(words).removeprefix("note: ")
        warnings.warn(words, DgdWarning, stacklevel=stacklevel + 1)


def _diagnostic(entry: dict[str, Any]) -> Diagnostic:
    places = tuple(Place(**{**place, "file": pythonic(place["file"])}) for place in entry["places"])
    advice = entry["help"]
    return Diagnostic(
        entry["code"], pythonic(entry["message"]), places, None if advice is None else pythonic(advice)
    )


def of_work(kind: str, task: str, message: str, mistakes: str) -> DgdError:
    """The exception for an error of a task."""
    diagnostics = tuple(_diagnostic(entry) for entry in json.loads(mistakes))
    text = pythonic(message)
    error: DgdError
    if kind == "usage":
        error = UsageError(text)
    elif kind == "computation":
        error = FitError(text) if task in ("fit", "discover") else SimulationError(text)
    elif not diagnostics:
        error = ModelError(text) if task == "load" else DataError(text)
    elif all(one.code.startswith("E6") for one in diagnostics):
        error = DataError(_with_units(text, diagnostics))
    elif all(one.span is not None and one.span.file.startswith("(") for one in diagnostics):
        # A name or value that was given with the call.
        error = UsageError(text)
    else:
        error = ModelError(text)
    error.diagnostics = diagnostics
    return error


def _with_units(text: str, diagnostics: tuple[Diagnostic, ...]) -> str:
    """Explains how to give units to a frame, if a column has none."""
    without = [one for one in diagnostics if one.message.endswith("has no unit")]
    names = [found[1] for one in without if (found := re.search(r"`([^`]+)` has no unit", one.message))]
    if not names:
        return text
    given = ", ".join(f'"{name}": "…"' for name in names)
    return f'{text}\n  or give `units={{{given}}}`, or `units="declared"` where all are in the model\'s units'


def internal(words: str) -> InternalError:
    """The exception for a bug in dgd."""
    return InternalError(
        "dgd has made a mistake; please report it with the call, the model, the data and this line: "
        f"dgd {__version__}, {words}"
    )
