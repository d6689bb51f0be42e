"""Problems of the published collection, which are not part of the project: tested where they lie beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from networks import judged

import dgd

pytest.importorskip("petab.v1", reason="petab is not installed: pip install 'dgd-models[petab]'")
COLLECTION = ROOT.parent / "shared" / "data" / "petab"
pytestmark = [
    pytest.mark.skipif(not COLLECTION.is_dir(), reason=f"there is no published collection in {COLLECTION}"),
    # petab's own, of what it calls in pandas.
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]

# Log-likelihoods at the nominal parameters, as published.
PUBLISHED = {
    "Boehm_JProteomeRes2014": -138.22200,
    "Elowitz_Nature2000": 63.20280,
    "Sneyd_PNAS2002": 319.79178,
}
# How long those take that start from a steady state, in their units of time.
SETTLE = {"Brannmark_JBC2010": 1e5, "Zheng_PNAS2012": 1e5}


def path(name: str) -> Path:
    """The problem file."""
    return COLLECTION / name / f"{name}.yaml"


@pytest.mark.parametrize(("name", "wanted"), PUBLISHED.items())
def test_the_likelihood_is_the_published_one(name: str, wanted: float) -> None:
    p = dgd.from_petab(path(name), noise="estimated", settle=SETTLE.get(name))
    likelihood, _ = judged(path(name), p.simulation(rtol=1e-9))
    assert likelihood == pytest.approx(wanted, rel=1e-6)


# Those whose published simulations are in the order of the measurements.
@pytest.mark.parametrize(
    "name",
    [
        "Boehm_JProteomeRes2014",
        "Bruno_JExpBot2016",
        "Elowitz_Nature2000",
        "Giordano_Nature2020",
        "Raia_CancerResearch2011",
    ],
)
def test_simulations_are_the_published_ones(name: str) -> None:
    import pandas as pd

    published = pd.read_csv(COLLECTION / name / f"simulatedData_{name}.tsv", sep="\t")["simulation"].to_numpy()
    mine = dgd.from_petab(path(name), noise="estimated").simulation(rtol=1e-8)["simulation"].to_numpy()
    # They were published with the tolerances of their solvers.
    assert np.abs(mine - published).max() < 1e-5 * np.abs(published).max()


# The converter makes another law of a decadic logarithm's noise; what is simulated is the same.
@pytest.mark.filterwarnings("ignore:Noise distribution:UserWarning")
@pytest.mark.parametrize("name", sorted(one.name for one in COLLECTION.glob("*/")))
def test_all_of_it_is_read_in_both_versions(name: str, tmp_path: Path) -> None:
    from petab.v2.petab1to2 import petab1to2

    petab1to2(str(path(name)), str(tmp_path))
    first, second = (
        dgd.from_petab(one, noise="estimated", settle=SETTLE.get(name)).simulation()
        for one in (path(name), tmp_path / f"{name}.yaml")
    )
    assert len(first) == len(rows(name))
    assert np.allclose(first["simulation"], second["simulation"], rtol=1e-6, atol=1e-9)


def rows(name: str) -> list[str]:
    """The rows of the measurement table."""
    return (COLLECTION / name / f"measurementData_{name}.tsv").read_text().strip().splitlines()[1:]


def test_a_fit_comes_back_to_the_published_optimum() -> None:
    name = "Boehm_JProteomeRes2014"
    p = dgd.from_petab(path(name), noise="estimated")
    # A tenth off in all parameters that the published optimum does not have at a bound.
    off = {one: 1.1 * p.model.parameters[one].value for one in ("Epo_degradation_BaF3", "k_imp_hetero", "k_exp_homo")}
    f = p.fit(params=off, noise="estimated", rtol=1e-8)
    # Of noise that is estimated for each output, the likelihood is that of the root-mean-square errors.
    count = len(rows(name)) / 3
    rms = np.array([one["rms_train"] for one in f.outputs.values()])
    likelihood = -count * np.sum(np.log(rms) + 0.5 * np.log(2 * np.pi) + 0.5)
    assert likelihood == pytest.approx(PUBLISHED[name], abs=1e-3)
