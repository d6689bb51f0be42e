"""The text that is written: formulas as petab reads them, and folders that the command fits."""

from __future__ import annotations

import json
import math
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from networks import TABLES, decay, problem

import dgd

pytest.importorskip("libsbml", reason="python-libsbml is not installed: pip install 'dgd-models[petab]'")
pytest.importorskip("petab.v1", reason="petab is not installed: pip install 'dgd-models[petab]'")

FORMULAS = [
    "-x^2",
    "x - (y - z)",
    "x - (y + z) - (-z)",
    "x/(y*z)/(x/y)",
    "(-x)^2*-y",
    "2^-x^y",
    "(x^y)^z",
    "-(x + y)*z - -x",
    "log(x) + ln(y) + log10(z) + log2(x) + log(x, y + 2)",
    "exp(-x) + sqrt(y) + abs(-z) + pow(x, 3) + sign(x - y)",
    "min(x, y)*max(y, z)",
    "sin(x) + cos(y)*tan(z) - sec(x)/csc(y) + cot(z)",
    "sinh(x) + cosh(y) - tanh(z) + sech(x) + csch(y)*coth(z)",
    "arcsin(x/9) + arccos(y/9) + arctan(z) + arcsinh(x) + arccosh(y + 1) + arctanh(z/9)",
    "arccot(x) + arcsec(y + 1) + arccsc(z + 1) + arccoth(x + 1) + arcsech(y/9) + arccsch(z)",
    "piecewise(x, y > z, z)",
    "piecewise(x, y > z && !(x < y), y, x <= z || y >= x, z + 1)*2",
    "1e-7*x + 3.5e+4/y",
]


@pytest.mark.parametrize("formula", FORMULAS)
def test_a_formula_means_what_petab_takes_it_for(formula: str, tmp_path: Path) -> None:
    from petab.v1.math import sympify_petab

    observables = f"observableId\tobservableFormula\tnoiseFormula\nobs\t{formula}\t0.1\n"
    parameters = TABLES["parameters"] + "".join(f"{one}\tlin\t0\t10\t1\t1\n" for one in "xyz")
    p = dgd.from_petab(problem(tmp_path, decay(), observables=observables, parameters=parameters))
    symbolic = sympify_petab(formula)
    for values in ((0.7, 1.9, 2.3), (2.1, 0.4, 1.2), (1.3, 3.1, 0.2)):
        given = dict(zip("xyz", values, strict=True))
        wanted = float(symbolic.subs({one: given[str(one)] for one in symbolic.free_symbols}))
        known = {name: value for name, value in given.items() if name in p.model.parameters}
        assert p.simulation(known)["simulation"][0] == pytest.approx(wanted, rel=1e-12)


def test_a_folder_is_what_the_command_fits(tmp_path: Path, command: Callable[..., str]) -> None:
    t = np.linspace(0, 4, 41)
    noise = 0.05 * np.random.default_rng(1).normal(size=(2, 41))
    rows = [
        f"obs\t{which}\t{start * math.exp(-0.8 * time) + one[k]}\t{time}\n"
        for which, start, one in (("low", 2.0, noise[0]), ("high", 5.0, noise[1]))
        for k, time in enumerate(t)
    ]
    p = dgd.from_petab(
        problem(
            tmp_path / "petab",
            decay(),
            conditions="conditionId\tA\nlow\t2\nhigh\tA_high\n",
            parameters=TABLES["parameters"] + "A_high\tlog10\t0.1\t100\t4\t1\n",
            observables="observableId\tobservableName\tobservableFormula\tnoiseFormula\nobs\twhat is left\tA\t0.05\n",
            measurements="observableId\tsimulationConditionId\tmeasurement\ttime\n" + "".join(rows),
        )
    )
    assert repr(p) == "<dgd.PetabProblem decay: 2 recordings, 82 readings>"
    f = p.fit()
    assert f.converged and abs(f.params["k"] - 0.8) < 4 * f.std["k"] < 0.04
    assert abs(f.params["A_high"] - 5) < 4 * f.std["A_high"] < 0.4
    model, *recordings = p.save(tmp_path / "written")
    assert [one.name for one in (model, *recordings)] == ["decay.dgd", "low.csv", "high.csv"]
    assert "/// what is left" in model.read_text()
    line = ["fit", str(model), "--noise", "declared", "--format", "json"]
    for one in recordings:
        line += ["--data", str(one)]
    theirs = json.loads(command(*line))
    assert {name: one["value"] for name, one in theirs["parameters"].items()} == f.params
    # Nothing of the command is left in this process: Ctrl-C is still Python's.
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    assert command("fmt", "--check", str(model)) == ""


def test_the_example_recovers_what_made_its_data() -> None:
    p = dgd.from_petab(ROOT / "examples" / "petab" / "receptor.yaml")
    f = p.fit(starts=5)
    truth = {"k_on": 0.45, "k_off": 0.07, "k_in": 0.03, "L_high": 5.0, "scale": 15.0}
    assert f.converged and list(f.params) == list(truth)
    for name, value in truth.items():
        assert abs(f.params[name] - value) < 3 * f.std[name] < 0.6 * value


def test_replicates_of_an_observable_are_all_read(tmp_path: Path) -> None:
    values = ((0, 2), (0, 2.2), (1, 1), (1, 1.1), (1, 1.2), (3, 0.4))
    rows = "".join(f"obs\tc0\t{value}\t{time}\n" for time, value in values)
    p = dgd.from_petab(
        problem(tmp_path, decay(), measurements="observableId\tsimulationConditionId\tmeasurement\ttime\n" + rows)
    )
    (columns,) = p.recordings.values()
    assert columns["time [s]"].tolist() == [0, 0, 0, 1, 1, 1, 3]
    assert np.nansum(columns["obs [1]"]) == pytest.approx(7.9)
    t = np.array([0, 0, 1, 1, 1, 3])
    assert np.allclose(p.simulation(rtol=1e-10)["simulation"], 2 * np.exp(-t / 2))
    residuals = 2 * np.exp(-t / 2) - [2, 2.2, 1, 1.1, 1.2, 0.4]
    o = p.objective(rtol=1e-10)
    assert o(o.x0) == pytest.approx(0.5 * np.sum((residuals / 0.1) ** 2))


def test_without_a_nominal_value_a_parameter_starts_in_the_middle(tmp_path: Path) -> None:
    head = "parameterId\tparameterScale\tlowerBound\tupperBound\testimate\tnominalValue\n"
    rows = "k\tlog10\t1e-3\t10\t1\t\nx\tlin\t1\t4\t1\t\ny\tlog10\t\t\t0\t0\n"
    observables = TABLES["observables"].replace("\tA\t", "\tA*x + y\t")
    p = dgd.from_petab(problem(tmp_path, decay(), parameters=head + rows, observables=observables))
    assert [one.value for one in p.model.parameters.values()] == pytest.approx([0.1, 2.5, 0])


def test_overrides_and_logarithms_make_outputs_of_their_own(tmp_path: Path) -> None:
    head = "observableId\tsimulationConditionId\tmeasurement\ttime\tobservableParameters\n"
    p = dgd.from_petab(
        problem(
            tmp_path,
            decay(),
            parameters=TABLES["parameters"] + "gain\tlin\t0\t10\t3\t1\n",
            observables="observableId\tobservableFormula\tobservableTransformation\tnoiseFormula\n"
            "obs\tA*observableParameter1_obs\tlog10\t0.1\n",
            measurements=head + "obs\tc0\t1\t1\tgain\nobs\tc0\t10\t1\t5\nobs\tc0\t100\t2\tgain\n",
        ),
        noise="estimated",
    )
    assert list(p.model.outputs) == ["log10_obs_1", "log10_obs_2"]
    (columns,) = p.recordings.values()
    assert columns["log10_obs_1 [1]"][1:].tolist() == [0, 2] and columns["log10_obs_2 [1]"][1] == 1
    wanted = [3 * 2 * math.exp(-0.5), 5 * 2 * math.exp(-0.5), 3 * 2 * math.exp(-1)]
    assert np.allclose(p.simulation(rtol=1e-10)["simulation"], wanted)


def test_what_is_not_measured_is_an_output_without_noise(tmp_path: Path) -> None:
    observables = TABLES["observables"] + "rest\tA\tnoiseParameter1_rest\n"
    p = dgd.from_petab(problem(tmp_path, decay(), observables=observables))
    assert {name: one.noise for name, one in p.model.outputs.items()} == {"obs": 0.1, "rest": None}


def test_sums_of_thousands_are_written(tmp_path: Path) -> None:
    formula = "+".join(f"{k}*A" for k in range(1, 3001)) + " - (A - 2*A)"
    observables = f"observableId\tobservableFormula\tnoiseFormula\nobs\t{formula}\t0.1\n"
    p = dgd.from_petab(problem(tmp_path, decay(), observables=observables))
    assert p.simulation()["simulation"][0] == pytest.approx(2 * (3000 * 3001 / 2 + 1), rel=1e-12)
