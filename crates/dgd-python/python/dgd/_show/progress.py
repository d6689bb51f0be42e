"""Progress of a long computation: tqdm bars if it is installed, or a function of the caller."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from types import TracebackType
from typing import Any, Union

#: Nothing: where somebody looks. ``True``, ``False``: yes, no. A function is called with what is counted, how many are
#: done, how many there will be, and whether that is only the most.
Progress = Union[Callable[[str, int, int, bool], object], bool, None]


# Seconds after which a bar appears.
_DELAY = 0.5


class Shown:
    """Shows progress while it is open."""

    def __init__(self, progress: Progress) -> None:
        self._bar: Any = None
        self._what = ""
        self._call: Callable[[str, int, int, bool], object] | None = None
        if callable(progress):
            self._call = progress
        elif progress or (progress is None and _is_watched()):
            self._call = self._advance if _tqdm() else None

    @property
    def call(self) -> Callable[[str, int, int, bool], None] | None:
        """The function that the native module calls."""
        call = self._call
        if call is None:
            return None

        def called(what: str, done: int, of: int, is_most: bool) -> None:
            call(what, done, of, is_most)

        return called

    def __enter__(self) -> Shown:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def _advance(self, what: str, done: int, of: int, is_most: bool) -> None:
        if self._bar is None or what != self._what or done < self._bar.n:
            if self._bar is not None:
                self._bar.close()
            words = what + (" (at most)" if is_most else "")
            # What takes no time needs no bar.
            self._bar = _tqdm()(total=of, desc=words, leave=False, delay=_DELAY, miniters=1, mininterval=0)
            self._what = what
        self._bar.total = of
        self._bar.update(done - self._bar.n)


def _tqdm() -> Any:
    if find_spec("tqdm") is None:
        return None
    # Without widgets a notebook gets bars of text.
    return import_module("tqdm.auto" if find_spec("ipywidgets") else "tqdm").tqdm


def _is_watched() -> bool:
    """Whether the output is interactive: a notebook, or a terminal."""
    shell = sys.modules.get("IPython")
    if shell is not None:
        instance = shell.get_ipython()
        if instance is not None and hasattr(instance, "kernel"):
            return True
    return bool(sys.stderr is not None and sys.stderr.isatty())
