"""Sensitivities: those of the command to the last bit, and those of differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from conftest import DATA, MODEL, Columns

import dgd

CSV = str(DATA / "circulation.csv")


def test_numbers_are_those_of_the_command_to_the_last_bit(circulation: Columns, command: Callable[..., str]) -> None:
    m = dgd.load(MODEL)
    s = m.sensitivity(circulation, of=["p_r", "h_r"], to="c0, h_r")
    line = ["sensitivity", MODEL, "--data", CSV, "--of", "p_r,h_r", "--to", "c0,h_r"]
    assert s.to_csv() == command(*line)
    assert (s.of, s.to, s.values.shape) == (["p_r", "h_r"], ["c0", "h_r(0)"], (3601, 2, 2))
    assert s.units["p_r", "c0"] == "bara/m" and s.units["h_r", "h_r(0)"] == "m/m"
    assert np.array_equal(s["p_r", "c0"], s.values[:, 0, 0]) and s["h_r", "h_r(0)"][0] == 1.0
    with pytest.raises(KeyError):
        s["p_r", "c1"]
    scaled = m.sensitivity(circulation, of=["p_r", "h_r"], to="c0, h_r", scaled=True)
    assert scaled.to_csv() == command(*line, "--scaled") and scaled.to == s.to
    assert np.allclose(scaled["p_r", "c0"], 275 * s["p_r", "c0"], rtol=1e-12)


def test_derivatives_are_those_of_differences(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    tight = {"until": 600.0, "rtol": 1e-10}
    s = m.sensitivity(circulation, of=["p_out", "q_ssp"], to=["c0", "F2"], **tight)
    for name, step in (("c0", 1e-3), ("F2", 1e3)):
        value = m.parameters[name].value
        assert value is not None
        up, down = (m.simulate(circulation, params={name: value + h}, **tight) for h in (step, -step))
        for of in s.of:
            # A state that an output is named like is meant, in its own unit.
            factor = 60000 if of == "q_ssp" else 1
            difference = (up[of] - down[of]) / (2 * step) / factor
            assert np.abs(s[of, name]).max() > 0
            assert np.allclose(s[of, name], difference, rtol=0, atol=1e-5 * np.abs(difference).max())


def test_everything_is_differentiated_where_nothing_is_named(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    s = m.sensitivity(circulation, until=10)
    assert s.to == list(m.parameters) and set(s.of) >= set(m.states)
    assert s.trajectories["h_r"][0] == 50.0 and len(s.time) == 11
    with pytest.raises(dgd.UsageError, match="did you mean `p_out`"):
        m.sensitivity(circulation, of="p_ou")
