"""Tables for notebooks."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .._data.outgoing import Series


def number(value: float | None, digits: int = 4) -> str:
    """A number as people read it; nothing where there is none."""
    if value is None or value != value:
        return ""
    return f"{value:.{digits}g}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts."""

    def line(cells: Sequence[str], tag: str) -> str:
        inside = "".join(f"<{tag} style='text-align:left'>{html.escape(cell)}</{tag}>" for cell in cells)
        return f"<tr>{inside}</tr>"

    body = "".join(line(row, "td") for row in rows)
    return f"<table><thead>{line(head, 'th')}</thead><tbody>{body}</tbody></table>"


def summary_of_series(title: str, series: Series) -> str:
    """What there is of each column: first, last, least and most."""
    rows = []
    for column in series.columns:
        values = column.values
        seen = values[np.isfinite(values)]
        ends = [values[0], values[-1], seen.min(), seen.max()] if seen.size else [None] * 4
        rows.append([column.name, column.unit, column.kind, *(number(value) for value in ends)])
    head = ["name", "unit", "", "first", "last", "least", "most"]
    return f"<p>{html.escape(title)}</p>" + table(head, rows)
