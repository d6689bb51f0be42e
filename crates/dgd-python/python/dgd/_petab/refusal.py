"""Collects unsupported constructs, so a user sees all of them at once."""

from __future__ import annotations

from .._errors import ModelError


class Refused(Exception):
    """An unsupported construct; :class:`Refusals` collects them."""


class Refusals:
    """The unsupported constructs of a problem."""

    def __init__(self) -> None:
        self._said: list[str] = []

    def add(self, words: str) -> None:
        """Adds a construct, by its kind and name."""
        if words not in self._said:
            self._said.append(words)

    def raise_if_any(self, what: str) -> None:
        """Raises :class:`ModelError` with all of them, one per line."""
        if self._said:
            lines = "".join(f"\n  - {words}" for words in self._said)
            raise ModelError(f"{what} cannot be imported:{lines}\ndocs/petab.md lists what can be")
