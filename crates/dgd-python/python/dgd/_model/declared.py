"""Declarations of a model."""

from __future__ import annotations

import html
import json
import os
from dataclasses import dataclass
from typing import Any

from .. import _dgd
from .._show.table import number, table


@dataclass(frozen=True)
class Quantity:
    """A declaration of a model: constant, parameter, input, state or output. Numbers are in ``unit``.

    ``value`` is that of a constant or parameter, or what a state starts with where that is a number; ``noise`` is the
    standard deviation of an output's sensor.
    """

    name: str
    unit: str
    doc: str
    value: float | None = None
    lower: float | None = None
    upper: float | None = None
    fixed: bool = False
    noise: float | None = None


class Declared:
    """The declarations of a model, and its representation in a notebook."""

    def __init__(self, native_model: _dgd.Model) -> None:
        self._native = native_model
        self._facts: dict[str, Any] = json.loads(native_model.description)

    @property
    def name(self) -> str:
        """Its name."""
        return str(self._facts["model"])

    @property
    def doc(self) -> str:
        """Its documentation in the text."""
        return str(self._facts["doc"])

    @property
    def path(self) -> str:
        """Its file, or the name of its text."""
        return os.fspath(self._native.path)

    @property
    def text(self) -> str:
        """Its text, including applied effects."""
        return self._native.text

    @property
    def latex(self) -> str:
        """Its equations as LaTeX."""
        return self._native.latex

    @property
    def inputs(self) -> dict[str, Quantity]:
        """Inputs by name."""
        return self._quantities("inputs")

    @property
    def states(self) -> dict[str, Quantity]:
        """States and other unknowns by name; elements of arrays are left out."""
        return self._quantities("states", value="start")

    @property
    def parameters(self) -> dict[str, Quantity]:
        """Parameters by name."""
        return self._quantities("parameters")

    @property
    def constants(self) -> dict[str, Quantity]:
        """Constants by name."""
        return self._quantities("constants")

    @property
    def outputs(self) -> dict[str, Quantity]:
        """Outputs by name."""
        return self._quantities("outputs")

    @property
    def equations(self) -> list[str]:
        """Labels of its equations."""
        return [entry["label"] for entry in self._facts["equations"]]

    @property
    def variants(self) -> dict[str, str]:
        """The choice of each variant."""
        return {entry["name"]: entry["chosen"] for entry in self._facts["variants"]}

    @property
    def description(self) -> dict[str, Any]:
        """The result of ``dgd check --format json``."""
        described: dict[str, Any] = json.loads(self._native.description)
        return described

    def _quantities(self, kind: str, value: str = "value") -> dict[str, Quantity]:
        found = {}
        for entry in self._facts[kind]:
            lower, upper = entry.get("bounds", (None, None))
            found[entry["name"]] = Quantity(
                entry["name"],
                entry["unit"],
                entry["doc"],
                entry.get(value),
                lower,
                upper,
                bool(entry.get("fixed", False)),
                entry.get("noise"),
            )
        return found

    def __repr__(self) -> str:
        counts = [
            f"{len(some)} {kind if len(some) != 1 else kind[:-1]}"
            for kind, some in (
                ("inputs", self.inputs),
                ("states", self.states),
                ("parameters", self.parameters),
                ("outputs", self.outputs),
            )
            if some
        ]
        return f"<dgd.Model {self.name}: {', '.join(counts)}>"

    def _repr_html_(self) -> str:
        style = "style='text-align:left'"
        lines = "".join(
            f"<tr><td {style}>{html.escape(label)}</td><td {style}>{formula}</td></tr>"
            for label, formula in self._native.equations
        )
        kinds = (
            ("input", self.inputs),
            ("state", self.states),
            ("parameter", self.parameters),
            ("output", self.outputs),
        )
        rows = [
            [one.name, kind, number(one.value, 6), one.unit, _bounds(one), one.doc]
            for kind, some in kinds
            for one in some.values()
        ]
        chosen = ", ".join(f"{name} = {choice}" for name, choice in self.variants.items())
        title = f"<b>{html.escape(self.name)}</b> {html.escape(chosen)}"
        doc = f"<p>{html.escape(self.doc)}</p>" if self.doc else ""
        declared = table(["name", "", "value", "unit", "bounds or noise", ""], rows)
        return f"<p>{title}</p>{doc}<table>{lines}</table>{declared}"


def _bounds(one: Quantity) -> str:
    if one.noise is not None:
        return f"± {number(one.noise)}"
    if one.lower is None and one.upper is None:
        return ""
    return f"{number(one.lower)} … {number(one.upper)}"
