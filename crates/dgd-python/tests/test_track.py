"""Estimates on line: those of the command, row by row."""

from __future__ import annotations

import json
import subprocess
import sys
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from conftest import MODEL, Columns

import dgd


def rows(data: Columns, n: int) -> list[dict[str, float]]:
    """The first rows, by header."""
    return [{header: float(values[k]) for header, values in data.items()} for k in range(n)]


def test_each_row_gives_what_the_command_prints(circulation: Columns, tmp_path: Path) -> None:
    n = 200
    text = ",".join(circulation) + "\n"
    text += "".join(",".join(repr(value) for value in row.values()) + "\n" for row in rows(circulation, n))
    line = [sys.executable, "-m", "dgd", "track", MODEL, "--data", "-", "--format", "json", "--gate", "4"]
    done = subprocess.run(line, input=text, capture_output=True, text=True, check=True)
    theirs = [json.loads(line) for line in done.stdout.splitlines()]
    m = dgd.load(MODEL)
    tracker = m.track(gate=4)
    units = {header.split(" ")[0]: header.split("[")[1][:-1] for header in circulation}
    named = m.track(gate=4, units=units)
    for row, expected in zip(rows(circulation, n), theirs[1:], strict=True):
        found = tracker.update(row)
        for name, one in expected["states"].items():
            assert (found.states[name].value, found.states[name].std) == (one["value"], one["std"])
        for name, one in expected["parameters"].items():
            assert (found.params[name].value, found.params[name].std) == (one["value"], one["std"])
        assert found.nis == expected["nis"] and found.time == expected["time"]
        bare = {header.split(" ")[0]: value for header, value in row.items()}
        assert named.update(bare).states == found.states
    settings = {key: value for key, value in theirs[0]["settings"].items() if key != "provenance"}
    assert {key: tracker.settings[key] for key in settings} == settings
    assert found["c0"] == found.params["c0"].value and found["h_r"] == found.states["h_r"].value
    assert any("200 rows" in words for words in tracker.close()) and tracker.close() == []
    with pytest.raises(dgd.UsageError, match="has ended"):
        tracker.update(rows(circulation, 1)[0])


def test_rows_may_have_stamps_and_gaps(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    begin = datetime(2026, 11, 21, 10, 57, tzinfo=timezone.utc)
    with m.track(units="declared") as tracker:
        for k, row in enumerate(rows(circulation, 30)):
            cells: dict[str, object] = {key.split(" ")[0]: value for key, value in row.items()}
            cells["time"] = begin + timedelta(seconds=k)
            if k % 3 == 1:
                del cells["p_r"], cells["w_ssp"]
            if k % 3 == 2:
                cells["q_ssp"] = None
            found = tracker.update(cells)
            assert found.time == k and ("p_r" in found.innovations) == (k % 3 != 1)
    all_at_once = m.track().run({key: values[:30] for key, values in circulation.items()})
    assert len(all_at_once) == 30 and abs(all_at_once[-1]["h_r"] - found["h_r"]) < 0.05


def test_what_cannot_be_tracked_is_told(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    first, second = rows(circulation, 2)
    with pytest.raises(dgd.UsageError, match="has its `time`"):
        m.track().update({"w_ssp [%]": 1.0})
    with pytest.raises(dgd.DataError, match="no column for the input `q_tf`"):
        m.track().update({key: value for key, value in first.items() if not key.startswith("q_tf")})
    tracker = m.track()
    tracker.update(first)
    with pytest.raises(dgd.UsageError, match="the first row had no `x`"):
        tracker.update({**second, "x": 1.0})
    with pytest.raises(dgd.DataError, match="the time goes back, from 0 s to -5 s"):
        tracker.update({**second, "time [s]": -5.0})
    with pytest.raises(dgd.UsageError, match="no state and no parameter|no state"):
        m.track(process_noise={"c9": 1.0}).update(first)
    with pytest.raises(dgd.UsageError, match="`estimator` must be"):
        m.track(estimator="kalman")
    # One that nobody closes ends by itself.
    del tracker
    assert np.isfinite(m.track(estimator="ukf").update(first)["h_r"])
