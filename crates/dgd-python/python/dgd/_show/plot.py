"""Figures of results with matplotlib: panels, curves and colours are those of dgd's own figures."""

from __future__ import annotations

import re
from functools import cache
from io import BytesIO
from typing import Any

import numpy as np

from .._data.bytes import array

# Pixels of dgd's pictures at their natural size, in points of matplotlib.
_POINTS = 0.75
_WIDTHS = {"line": 1.6, "thin": 0.8}
_SIZES = {"dots": 2.6, "marks": 7.0}
# How much white a recorded signal has, so that a line in front of its noise stands out.
_TINT = 0.35
_PANEL_HEIGHT, _WIDTH = 2.1, 8.4


def _subscripts(text: str) -> str:
    """`q_a` with a subscript, as in dgd's figures."""
    return re.sub(r"([^\W_]+)_([^\W_]+(?:,[^\W_]+)*)", r"$\\mathregular{\1_{\2}}$", text)


def _tinted(colour: str) -> tuple[float, float, float]:
    parts = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    red, green, blue = (part + _TINT * (1 - part) for part in parts)
    return red, green, blue


@cache
def _drawing() -> Any:
    from matplotlib.figure import Figure

    class Drawing(Figure):
        """A figure that a notebook shows, with or without pyplot; ``savefig(path)`` writes it."""

        def _repr_png_(self) -> bytes:
            png = BytesIO()
            self.savefig(png, format="png", dpi=120)
            return png.getvalue()

    return Drawing


def draw(figure: dict[str, Any]) -> Any:
    """A matplotlib figure of the contents given by the native module."""
    panels = figure["panels"]
    columns = max(1, min(figure["columns"], len(panels)))
    rows = -(-len(panels) // columns)
    drawn = _drawing()(figsize=(_WIDTH, _PANEL_HEIGHT * max(rows, 1) + 0.4), layout="constrained")
    if figure["title"]:
        drawn.suptitle(_subscripts(figure["title"]), fontsize="medium")
    first = None
    for k, panel in enumerate(panels):
        axes = drawn.add_subplot(rows, columns, k + 1, sharex=first)
        first = first or axes
        _panel(axes, panel)
        if k + columns >= len(panels):
            axes.set_xlabel(_subscripts(figure["x_label"]))
        else:
            axes.tick_params(labelbottom=False)
    return drawn


def _panel(axes: Any, panel: dict[str, Any]) -> None:
    axes.set_title(_subscripts(panel["title"]), fontsize="medium", loc="left")
    axes.set_ylabel(_subscripts(panel["y_label"]))
    axes.grid(color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for begin, end in panel["bands"]:
        axes.axvspan(begin, end, color="#f0f0f0", zorder=0)
    for envelope in panel["envelopes"]:
        axes.fill_between(
            array(envelope["x"]),
            array(envelope["low"]),
            array(envelope["high"]),
            color=envelope["colour"],
            label=_label(envelope["name"]),
            linewidth=0,
            zorder=1,
        )
    if "map" in panel:
        _cells(axes, panel["map"])
    for series in panel["series"]:
        _series(axes, series)
    named = len(panel["series"]) > 1 or any(envelope["name"] for envelope in panel["envelopes"])
    if named and axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize="small", frameon=False)


def _cells(axes: Any, cells: dict[str, Any]) -> None:
    from matplotlib.colors import ListedColormap

    values = np.array([array(row) for row in cells["values"]])
    drawn = axes.pcolormesh(
        array(cells["x"]), array(cells["places"]), values, cmap=ListedColormap(cells["colours"]), shading="nearest"
    )
    axes.grid(visible=False)
    axes.figure.colorbar(drawn, ax=axes, pad=0.01)


def _label(name: str) -> str | None:
    return _subscripts(name) if name else None


def _series(axes: Any, series: dict[str, Any]) -> None:
    x, y, style = array(series["x"]), array(series["y"]), series["style"]
    n = min(len(x), len(y))
    x, y = x[:n], y[:n]
    if style in _SIZES:
        colour = _tinted(series["colour"]) if style == "dots" else series["colour"]
        size = _SIZES[style] * _POINTS
        order = 2 if style == "dots" else 5
        axes.plot(
            x, y, "o", color=colour, markersize=size, markeredgewidth=0, label=_label(series["name"]), zorder=order
        )
        return
    width = _WIDTHS[style] * _POINTS
    line = {"color": series["colour"], "linewidth": width, "label": _label(series["name"]), "zorder": 4}
    if style == "thin":
        # A recorded signal stands behind what is computed.
        line.update(color=_tinted(series["colour"]), zorder=3)
    if series["dashes"]:
        line["linestyle"] = (0, [length * _POINTS / width for length in series["dashes"]])
    axes.plot(x, y, **line)
