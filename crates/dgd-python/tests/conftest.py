"""What tests share: the models and recordings of the repository, and the command."""

from __future__ import annotations

import csv
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
MODEL = str(ROOT / "models" / "mud_circulation.dgd")
DATA = ROOT / "examples" / "data"

Columns = dict[str, np.ndarray]

# A shell's background jobs ignore Ctrl-C, which Python then leaves so, and the tests send it.
signal.signal(signal.SIGINT, signal.default_int_handler)

COOLING = """\
model cooling
parameter tau [s] = 100 in 1 .. 1e4
state T [K] = 80
equation cooling: tau*der(T) = -T
output T [K] noise 0.1
"""


def columns(path: Path) -> Columns:
    """The columns of a CSV file by header, read by Python alone."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    numbers = [[float(cell) if cell else np.nan for cell in row] for row in rows[1:]]
    return {header: np.array(values) for header, values in zip(rows[0], zip(*numbers), strict=True)}


def cup(tau: float, seed: int) -> Columns:
    """A cup that cools, by its closed formula."""
    t = np.linspace(0, 400, 81)
    noise = 0.1 * np.random.default_rng(seed).normal(size=t.size)
    return {"time [s]": t, "T [K]": 75 * np.exp(-t / tau) + noise}


@pytest.fixture(scope="session")
def circulation() -> Columns:
    """An hour of mud circulation, by header."""
    return columns(DATA / "circulation.csv")


@pytest.fixture(scope="session")
def command() -> Callable[..., str]:
    """Runs `dgd` as it was installed, in the repository's root; what it prints."""

    def run(*words: str) -> str:
        line = [sys.executable, "-m", "dgd", *words]
        done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
