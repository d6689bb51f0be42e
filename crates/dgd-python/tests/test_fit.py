"""Fits and searches: what the command finds, Ctrl-C, progress, and what cannot be fitted."""

from __future__ import annotations

import json
import math
import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import COOLING, DATA, MODEL, ROOT, Columns, columns, cup

import dgd

CSV = str(DATA / "circulation.csv")

def same(mine: object, theirs: object, place: str = "") -> None:
    """Checks that results agree, but for what names files and versions of numbers cannot agree in."""
    if isinstance(mine, dict) and isinstance(theirs, dict):
        assert list(mine) == list(theirs), place
        for key in mine:
            if key not in ("provenance", "data"):
                same(mine[key], theirs[key], f"{place}.{key}")
    elif isinstance(mine, list) and isinstance(theirs, list):
        assert len(mine) == len(theirs), place
        for k, pair in enumerate(zip(mine, theirs, strict=True)):
            same(*pair, f"{place}[{k}]")
    else:
        assert mine == theirs, place


def test_a_fit_is_the_commands_to_the_last_bit(
    circulation: Columns, command: Callable[..., str], tmp_path: Path
) -> None:
    m = dgd.load(MODEL)
    f = m.fit([circulation], starts=3, noise="declared", profile="c0", seed=7)
    line = ["fit", MODEL, "--data", CSV, "--starts", "3", "--noise", "declared", "--profile", "c0", "--seed", "7"]
    theirs = json.loads(command(*line, "--format", "json", "--threads", "1"))
    same(f.result, theirs)
    # What is handed out is what is in there.
    c0 = theirs["parameters"]["c0"]
    assert (f.params["c0"], f.std["c0"], f.units["c0"]) == (c0["value"], c0["std"], "m")
    assert f.converged and f.left_out == [] and f.names == ["M_ssp", "c0", "c2", "F2"]
    assert math.isclose(f.cov[1, 1], f.std["c0"] ** 2, rel_tol=1e-9)
    assert np.array_equal(f.cov, np.array(theirs["covariance"])) and f.correlation[2, 2] == pytest.approx(1)
    assert f.starts[0]["h_r"] == theirs["starts"][0]["values"]["h_r"]["value"]
    # The truth of the recording is known.
    for name, truth in (("M_ssp", 0.9e8), ("c0", 281.0), ("c2", 9.6e3), ("F2", 1.82e8)):
        assert abs(f.params[name] - truth) < 4 * f.std[name]
    f.save(tmp_path / "found")
    assert json.loads((tmp_path / "found" / "result.json").read_text()) == f.result
    assert "c0" in str(f) and "281.0" in repr(f) and "<table>" in f._repr_html_()
    assert f.report().html.startswith("<!") and "dgd.load" in f.report().html
    # The fitted model is a model like any other.
    assert f.model.parameters["c0"].value == pytest.approx(f.params["c0"], rel=1e-9)
    before, after = (one.simulate(circulation)["p_r"] - circulation["p_r [bara]"] for one in (m, f.model))
    assert np.std(after) < 0.011 < 2 * np.std(before)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            dict(estimator="recursive", filter=[5, 5.0], forgetting=1e-4, start_variance=20, most_variance=50.0,
                 normalise="regressors"),
            ["--filter", "5,5", "--forgetting", "1e-4", "--start-variance", "20", "--most-variance", "50",
             "--normalise", "regressors"],
        ),
        (dict(estimator="linearised", at=600, noise="declared"), ["--at", "600", "--noise", "declared"]),
        (dict(estimator="linearized", at="steady"), ["--at", "steady"]),
        (dict(estimator="separable", smoothing="1min", steady={"h_r": 1.0}), ["--smoothing", "60", "--steady", "h_r=1"]),
        (dict(estimator="output-error", starts=3, start_point=1), ["--starts", "3", "--start-point", "1"]),
        (dict(estimator="output-error", bootstrap=2, bootstrap_from=4), ["--bootstrap", "2", "--bootstrap-from", "4"]),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::dgd.DgdWarning")
def test_every_option_of_a_fit_is_the_commands(
    arguments: dict[str, Any], words: list[str], command: Callable[..., str]
) -> None:
    f = dgd.load(MODEL).fit([CSV], **arguments)
    line = ["fit", MODEL, "--data", CSV, "--estimator", arguments["estimator"], *words, "--format", "json"]
    same(f.result, json.loads(command(*line)))


def test_profiles_are_found_afterwards_too(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    at_once = m.fit(circulation, noise="declared", profile="c0")
    later = m.fit(circulation, noise="declared").profile("c0", "h_r(0)")
    (one,) = at_once.profile("c0").values()
    assert list(later) == ["c0", "h_r(0)"] and later["h_r(0)"].unit == "m"
    assert later["c0"].lower == pytest.approx(one.lower, abs=1e-4 * at_once.std["c0"])
    # A quadratic likelihood has an interval of 1.96 standard errors on each side.
    assert one.upper - one.lower == pytest.approx(2 * 1.96 * at_once.std["c0"], rel=0.02)
    assert one.deviance.min() == 0.0 and one.threshold == pytest.approx(3.841, abs=1e-3)


def test_several_recordings_and_validation() -> None:
    m = dgd.parse(COOLING)
    f = m.fit({"monday": cup(124, 1), "tuesday": cup(124, 2)}, valid=[cup(124, 3)], noise="declared")
    assert abs(f.params["tau"] - 124) < 4 * f.std["tau"] and [s["T"] for s in f.starts] == pytest.approx([75, 75], 0.01)
    names = [one["file"] for one in f.provenance["data"]]
    assert names == ["monday", "tuesday", "valid"]
    assert f.outputs["T"]["rms_valid"] == pytest.approx(0.1, rel=0.3)
    twice = m.fit([cup(124, 1), cup(124, 2)], valid=[cup(124, 3), cup(124, 4)])
    assert [one["file"] for one in twice.provenance["data"]] == ["data 1", "data 2", "valid 1", "valid 2"]
    named = m.fit([cup(124, 1)], valid={"data": cup(124, 3)})
    assert [one["file"] for one in named.provenance["data"]] == ["data", "data (2)"]


def test_a_fit_that_did_not_converge_is_a_result(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    with pytest.warns(dgd.DgdWarning, match="not converged: no minimum was reached in 2 simulations"):
        f = m.fit(circulation, evaluations=2)
    assert not f.converged and len(f.left_out) == 1 and "not converged" in repr(f)


def test_where_no_point_can_be_evaluated_there_is_no_fit() -> None:
    m = dgd.parse("model m\nparameter a [1/s] = 1\nstate x [1] = 1\nequation e: der(x) = a*x^2\noutput x [1]\n")
    with pytest.raises(dgd.FitError, match="cannot be simulated"):
        m.fit({"time [s]": [0.0, 1.0, 5.0, 6.0, 7.0, 8.0], "x [1]": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]})
    with pytest.raises(dgd.DataError, match="outputs are `x"):
        m.fit({"time [s]": [0.0, 1.0], "y [1]": [1.0, 2.0]}, units=None)
    with pytest.raises(dgd.UsageError, match="no recording"):
        m.fit([])
    with pytest.raises(dgd.UsageError, match='`loss` must be "squares" or'):
        m.fit(cup(1, 1), loss="absolute")
    with pytest.raises(dgd.UsageError, match="`start_variance` must be a number above 0, not -1"):
        m.fit(cup(1, 1), start_variance=-1)
    with pytest.raises(dgd.UsageError, match="`starts`: 0 is not in 1..=100000"):
        m.fit(cup(1, 1), starts=0)


def test_progress_is_told(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    told: list[tuple[str, int, int, bool]] = []
    m.fit([circulation], starts=6, progress=lambda *one: told.append(one))
    assert told and told[-1][1] <= told[-1][2] and all(isinstance(one[0], str) for one in told)

    def objects(*_: object) -> None:
        raise LookupError("of my own")

    with pytest.raises(LookupError, match="of my own"):
        m.fit([circulation], starts=20, progress=objects)


def after(seconds: float, act: Callable[[], object]) -> threading.Timer:
    """Does something later."""
    timer = threading.Timer(seconds, act)
    timer.start()
    return timer


def interrupt() -> None:
    """Ctrl-C."""
    os.kill(os.getpid(), signal.SIGINT)


def test_ctrl_c_ends_a_fit_with_the_best_so_far(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    timer = after(0.7, interrupt)
    begin = time.monotonic()
    with pytest.warns(dgd.DgdWarning):
        f = m.fit([circulation] * 2, starts=100_000, threads=1)
    timer.join()
    assert time.monotonic() - begin < 30 and f.left_out and f.params["c0"] > 0
    assert f.result["status"] == "stopped"


def test_ctrl_c_ends_a_simulation_at_once() -> None:
    # It takes many seconds.
    m = dgd.load(ROOT / "models" / "transmission_line.dgd", params={"N": 1000})
    inputs = {"time [s]": [0.0, 20.0], "q_in [m^3/s]": [0.03, 0.036], "p_out [bar]": [300.0, 310.0]}
    timer = after(0.3, interrupt)
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        m.simulate(inputs, every=1.0, rtol=1e-8)
    timer.join()
    assert time.monotonic() - begin < 3
    # The thread that computed has stopped, too.
    time.sleep(0.5)
    used = time.process_time()
    time.sleep(0.5)
    assert time.process_time() - used < 0.25


def test_a_discovery_is_the_commands(command: Callable[..., str], tmp_path: Path) -> None:
    files = [DATA / f"booster_stop.{part}.csv" for part in ("train", "valid")]
    train, valid = (columns(file) for file in files)
    m = dgd.load(MODEL)
    d = m.discover({files[0].name: train}, valid={files[1].name: valid})
    line = ["discover", MODEL, "--data", str(files[0]), "--valid", str(files[1])]
    theirs = json.loads(command(*line, "--format", "json"))
    same(d.result, theirs)
    assert d.verdict == "effects" and not d.cut_short and d.unexplained == theirs["unexplained"]
    (effect,) = d.effects
    assert (effect.name, effect.kind, effect.target) == ("booster_u_tubing", "plant", "riser")
    assert effect.params["F_b"] == theirs["effects"][0]["parameters"]["F_b"]["value"] and effect.windows
    assert d.diff.startswith("--- a/mud_circulation.dgd") and "+modes booster_line" in d.diff
    # The corrected model runs, and explains the recording that it has not seen.
    gap = {name: one["valid_after"] for name, one in d.gap.items()}
    assert gap["p_r"] < 1.2 * d.gap["p_r"]["noise"] < d.gap["p_r"]["valid_before"]
    assert len(d.model.simulate(valid, until=60.0).time) == 61
    d.save(tmp_path / "found")
    assert (tmp_path / "found" / "report.html").read_text() == d.report().html
    assert "booster_u_tubing" in repr(d) and "booster_u_tubing" in str(d) and "<table>" in d._repr_html_()


def test_a_plain_cause_is_listed() -> None:
    m = dgd.parse(COOLING.replace("100 in 1 .. 1e4", "100 fixed"))
    # A model that is a text has no folder of effects, and the search says so.
    with pytest.warns(dgd.DgdWarning, match="only templates"):
        d = m.discover([cup(112, 1)], valid=[cup(112, 2)])
    assert d.verdict == "plain" and not d.effects and not d.law
    cause = d.plain[0]
    assert (cause["kind"], cause["name"], cause["unit"], cause["declared"]) == ("parameter", "tau", "s", 100)
    assert abs(cause["value"] - 112) < 4 * cause["std"] < 2
    assert repr(d) == "<dgd.Discovery: plain: tau>"
    # The corrected model has the value.
    assert "tau" in d.diff and d.model.simulate(until=400.0)["T"][-1] < 80 * math.exp(-400 / 115)


def test_words_name_arguments_and_not_options_of_the_command() -> None:
    train = columns(DATA / "booster_stop.train.csv")
    m = dgd.load(MODEL)
    with pytest.warns(dgd.DgdWarning, match="when the time of `budget` had passed"):
        d = m.discover([train], budget=0.1)
    assert d.cut_short and "`valid`" in str(d) and "`--" not in str(d) + "".join(d.reservations)


def test_ctrl_c_ends_a_discovery_with_the_best_so_far() -> None:
    train = columns(DATA / "booster_stop.train.csv")
    m = dgd.load(MODEL)
    timer = after(0.5, interrupt)
    with pytest.warns(dgd.DgdWarning, match="the search was stopped: this is the best so far"):
        d = m.discover([train], threads=1)
    timer.join()
    assert d.cut_short and d.verdict in ("sufficient", "plain", "effects", "law", "unexplained")
