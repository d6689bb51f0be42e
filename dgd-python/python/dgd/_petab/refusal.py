"""What cannot be said in the language, collected, so that a user reads all of it at once."""

from __future__ import annotations

from .._errors import ModelError


class Refused(Exception):
    """One thing that cannot be said; :class:`Refusals` collects it."""


class Refusals:
    """What a problem has that cannot be said."""

    def __init__(self) -> None:
        self._said: list[str] = []

    def add(self, words: str) -> None:
        """Notes a thing, by its kind and name."""
        if words not in self._said:
            self._said.append(words)

    def raise_if_any(self, what: str) -> None:
        """Raises :class:`ModelError` with all of them, each in a line."""
        if self._said:
            lines = "".join(f"\n  - {words}" for words in self._said)
            raise ModelError(f"{what} cannot be imported:{lines}\ndocs/petab.md lists what can be")
