"""What a model lacks, as recordings show it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .. import _dgd
from .._show.table import number, table
from .found import Findings

if TYPE_CHECKING:
    from .._model.model import Model


@dataclass(frozen=True)
class Effect:
    """An effect that was found: ``params`` in their units, ``windows`` in s; ``result`` has all there is."""

    name: str
    kind: str
    form: str | None
    target: str | None
    params: dict[str, float]
    units: dict[str, str]
    windows: list[tuple[float, float]]
    result: dict[str, Any] = field(repr=False)


class Discovery(Findings):
    """A search: ``verdict`` is ``"sufficient"``, ``"plain"``, ``"effects"``, ``"law"`` or ``"unexplained"``.

    ``effects`` lists the effects that were found, and ``law`` the terms of a law.

    ``model`` is the corrected model, ``diff`` how its text differs, ``report()`` the page, ``result`` all that
    ``result.json`` of ``dgd discover`` has.
    """

    def __init__(self, native: _dgd.Found, model: Callable[[str], Model]) -> None:
        super().__init__(native)
        self.verdict: str = self.result["verdict"]
        self.effects: list[Effect] = [_effect(entry) for entry in self.result["effects"]]
        #: Terms that equations lacked, with the verdict ``"law"``: ``target``, ``formula`` and ``coefficients``.
        self.law: list[dict[str, Any]] = (self.result["law"] or {}).get("terms", [])
        #: Wrong numbers of the model's text and faults of the recordings, with the verdict ``"plain"``: the cause, then
        #: its twins, each with its ``kind``, ``name``, ``declared``, ``value``, ``std`` and ``unit``; where recordings
        #: differ, the ``values`` that they have, and ``since`` when a column is stuck.
        self.plain: list[dict[str, Any]] = (self.result["plain"] or {}).get("causes", [])
        #: Laws in different equations that explain the recordings alike: ``terms``, ``left`` and ``told_apart_by``.
        self.rivals: list[dict[str, Any]] = self.result["rivals"]
        #: What no known effect explains: ``target``, ``windows`` and a ``description`` of each.
        self.unexplained: list[dict[str, Any]] = self.result["unexplained"]
        #: For each output its ``unit``, ``noise``, and root-mean-square errors before and after.
        self.gap: dict[str, dict[str, Any]] = self.result["gap"]
        #: Whether the search ended before it had tried everything.
        self.cut_short: bool = native.is_cut_short
        #: Why the recordings may not say what they are asked.
        self.reservations: list[str] = self._reservations()
        self._make = model
        self._model: Model | None = None

    @property
    def model(self) -> Model:
        """The corrected model; the given one where nothing was found."""
        if self._model is None:
            self._model = self._make(self._native.model_text("."))
        return self._model

    @property
    def diff(self) -> str:
        """How the corrected model's text differs from the given one's."""
        files = dict(self._native.files("."))
        return next(text for name, text in files.items() if name.endswith(".diff")).decode()

    def __repr__(self) -> str:
        terms = [f"{term['formula']} in {term['target']}" for term in self.law]
        causes = [cause["name"] for cause in self.plain[:1]]
        names = ", ".join(causes + [effect.name for effect in self.effects] + terms)
        return f"<dgd.Discovery: {self.verdict}{': ' if names else ''}{names}>"

    def _repr_html_(self) -> str:
        rows = [
            [effect.name, effect.kind, effect.target or "", name, number(value, 4), effect.units[name]]
            for effect in self.effects
            for name, value in effect.params.items()
        ]
        head = ["effect", "kind", "in", "parameter", "value", "unit"]
        gap = [
            [name, one["unit"], *(number(one.get(key), 3) for key in _GAP.values())] for name, one in self.gap.items()
        ]
        errors = table(["output", "unit", *_GAP], gap)
        found = table(head, rows) if rows else ""
        return f"<p>{self.verdict}</p>{found}<p>simulation error, root mean square</p>{errors}"


_GAP = {
    "noise": "noise",
    "training": "train_before",
    "after": "train_after",
    "validation": "valid_before",
    "after it": "valid_after",
}


def _effect(entry: dict[str, Any]) -> Effect:
    parameters = entry["parameters"]
    return Effect(
        entry["name"],
        entry["kind"],
        entry.get("form"),
        entry.get("target"),
        {name: float(one["value"]) for name, one in parameters.items()},
        {name: one["unit"] for name, one in parameters.items()},
        [(begin, end) for begin, end in entry["windows"]],
        entry,
    )
