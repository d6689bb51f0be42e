"""The cases of PEtab's own test suite: likelihoods and simulations as it gives them, or refused for a reason."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from networks import judged

import dgd

pytest.importorskip("petab.v1", reason="petab is not installed: pip install 'dgd-models[petab]'")
found = importlib.util.find_spec("petabtests")
if found is None or found.origin is None:
    pytest.skip("petabtests is not installed: .ci/python --all installs it", allow_module_level=True)
CASES = Path(found.origin).parent / "cases" / "v1.0.0" / "sbml"

pytestmark = [
    # petab's own, of what it calls in pandas.
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    # Steady starts keep the sum of the two species.
    pytest.mark.filterwarnings("ignore:the equations conserve `A . B`:dgd.DgdWarning"),
]

ALL = range(1, 19)
# Those that start from a steady state: the slowest rate is 0.9.
SETTLED = {9, 10, 17, 18}
# Those whose likelihood is more than χ²: with noise of a logarithm, or noise that is estimated.
NOT_CHI_SQUARE = {7, 15, 16}


def case(k: int) -> Path:
    """The problem file of a case."""
    return CASES / f"{k:04}" / f"_{k:04}.yaml"


def solution(k: int) -> dict[str, Any]:
    """What the suite says of a case, with its simulations in the order of the measurements."""
    import pandas as pd
    import yaml

    folder = case(k).parent
    found: dict[str, Any] = yaml.safe_load((folder / f"_{k:04}_solution.yaml").read_text())
    (file,) = found["simulation_files"]
    return {**found, "simulation": pd.read_csv(folder / file, sep="\t")["simulation"].to_numpy()}


def test_all_cases_are_there() -> None:
    assert sorted(int(one.name) for one in CASES.iterdir() if one.name.isdigit()) == list(ALL)


@pytest.mark.parametrize("k", ALL)
def test_a_case_is_as_the_suite_says(k: int) -> None:
    wanted = solution(k)
    p = dgd.from_petab(case(k))
    simulation = p.simulation(rtol=1e-10)
    assert np.allclose(simulation["simulation"], wanted["simulation"], rtol=1e-8, atol=1e-9)
    assert judged(case(k), simulation) == pytest.approx((wanted["llh"], wanted["chi2"]), abs=1e-6)
    # What a fit makes small is half of χ² where noise is a number: outputs carry the noise of the problem.
    if k not in NOT_CHI_SQUARE:
        assert p.objective(rtol=1e-10)(p.objective().x0) == pytest.approx(wanted["chi2"] / 2, abs=1e-6)


@pytest.mark.parametrize("k", SETTLED)
def test_a_steady_state_takes_a_time(k: int) -> None:
    with pytest.warns(dgd.DgdWarning, match="not at rest at the end of the run-in of `preeq_c0_then_c0`: .*`A`"):
        dgd.from_petab(case(k), settle=2.0)


def test_where_a_fit_estimates_the_noise_none_is_declared() -> None:
    p = dgd.from_petab(case(15), noise="estimated")
    assert p.model.outputs["obs_a"].noise is None and "noise" not in p.model.parameters
    simulation = p.simulation(rtol=1e-10)
    assert judged(case(15), simulation)[0] == pytest.approx(solution(15)["llh"], abs=1e-6)


# The converter makes another law of a decadic logarithm's noise; what is simulated is the same.
@pytest.mark.filterwarnings("ignore:Noise distribution:UserWarning")
@pytest.mark.parametrize("k", ALL)
def test_what_petab_converts_to_version_2_is_the_same(k: int, tmp_path: Path) -> None:
    from petab.v2.petab1to2 import petab1to2

    petab1to2(str(case(k)), str(tmp_path))
    first, second = dgd.from_petab(case(k)), dgd.from_petab(tmp_path / case(k).name)
    mine, theirs = first.simulation(rtol=1e-10), second.simulation(rtol=1e-10)
    assert np.allclose(mine["simulation"], theirs["simulation"], rtol=1e-10)
    assert list(first.model.parameters) == list(second.model.parameters)
    for name, one in first.model.parameters.items():
        other = second.model.parameters[name]
        assert (one.value, one.lower, one.upper, one.fixed) == (other.value, other.lower, other.upper, other.fixed)


def test_an_older_draft_of_version_2_cannot_be_read() -> None:
    draft = CASES.parents[1] / "v2.0.0" / "sbml" / "0001" / "_0001.yaml"
    with pytest.raises(dgd.DataError, match="_0001.yaml cannot be read by petab"):
        dgd.from_petab(draft)
