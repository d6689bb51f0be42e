"""Loading: what a model declares, mistakes with their places, pickles, and models that do not change."""

from __future__ import annotations

import copy
import pickle
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from conftest import MODEL, ROOT

import dgd

TANK = """\
/// A tank that runs empty.
model tank
import "valves.dgd"
input q_in [lpm] hold
parameter A [m^2] = 2 in 0.1 .. 10, fixed   /// cross-section
parameter k [lpm] = 300 in 0 ..
state h [cm] = 100
equation level: A * der(h) = q_in - k * opening(h)
output h [cm] noise 1 [mm]
"""
VALVES = "function opening(h [m]) = sqrt(max(h, 0) / 1 [m])\n"


def test_a_model_says_what_it_declares() -> None:
    m = dgd.load(MODEL)
    assert (m.name, m.path, m.variants) == ("mud_circulation", MODEL, {"flow": "dynamic", "inertia": "constant"})
    assert list(m.inputs) == ["w_ssp", "q_boost", "q_tf"]
    c0 = m.parameters["c0"]
    assert (c0.value, c0.unit, c0.lower, c0.upper, c0.fixed) == (275.0, "m", 0.0, None, False)
    assert m.parameters["F1"].fixed and m.outputs["p_r"].unit == "bara"
    assert m.outputs["p_r"].noise == pytest.approx(0.01)
    assert m.states["h_r"].value == 50.0 and m.states["q_ssp"].value is None
    assert m.equations == ["riser", "return_line"]
    assert "<math" in m._repr_html_() and "der" not in m.latex and "A_" in m.latex
    assert "6 parameters" in repr(m)


def test_variants_values_and_effects_are_chosen() -> None:
    m = dgd.load(MODEL, variant={"flow": "static"}, params={"c0": 280, "F2": "1.8e8 [Pa*s^2/m^6]"}, apply=["pump_wear"])
    assert m.variants["flow"] == "static" and m.parameters["c0"].value == 280.0
    assert m.parameters["F2"].value == 1.8e8 and "pump_wear" in m.text
    other = m.changed(variant={"flow": "dynamic"}, params={"c0": 281}, apply=[])
    assert (other.variants["flow"], other.parameters["c0"].value) == ("dynamic", 281.0)
    assert other.parameters["F2"].value == 1.8e8 and other.text != m.text


def test_mistakes_of_a_model_have_code_place_and_help() -> None:
    text = "model m\nparameter tau [s] = 3\nstate x [m] = 1\nequation e: tau*der(x) = -x*ta\n"
    with pytest.raises(dgd.ModelError) as raised:
        dgd.parse(text, name="m.dgd")
    (one,) = raised.value.diagnostics
    assert one.code == "E201" and one.span is not None and "tau" in (one.help or "")
    assert (one.span.file, one.span.line, one.span.column, one.span.end_column) == ("m.dgd", 4, 29, 31)
    assert "error[E201]" in str(raised.value) and isinstance(raised.value, dgd.DgdError)


def test_what_is_not_there_is_named() -> None:
    with pytest.raises(FileNotFoundError):
        dgd.load("no such file.dgd")
    with pytest.raises(dgd.UsageError, match="did you mean `c0`"):
        dgd.load(MODEL, params={"c9": 1.0})
    with pytest.raises(dgd.UsageError, match="finite number"):
        dgd.load(MODEL, params={"c0": float("nan")})
    with pytest.raises(dgd.ModelError, match="pump_wear"):
        dgd.load(MODEL, apply=["pump_ware"])
    with pytest.raises(dgd.UsageError, match="is an effect, not a model"):
        effect = ROOT / "models" / "effects" / "pump_wear.dgd"
        dgd.parse(effect.read_text(), name="elsewhere/pump_wear.dgd")
    with pytest.raises(AttributeError):
        dgd.lod  # type: ignore[attr-defined]


def test_a_pickle_has_texts_and_options(tmp_path: Path) -> None:
    (tmp_path / "tank.dgd").write_text(TANK)
    (tmp_path / "valves.dgd").write_text(VALVES)
    (tmp_path / "effects").mkdir()
    leak = "effect leak on tank\nkind plant\nparameter q_l [lpm] = 9 in 0 ..\nnull q_l = 0\nreplace q_in by q_in - q_l\n"
    (tmp_path / "effects" / "leak.dgd").write_text(leak)
    m = dgd.load(tmp_path / "tank.dgd", params={"k": 310})
    before = m.simulate({"time [s]": [0.0, 60.0], "q_in [lpm]": [300.0, 300.0]})
    pickled = pickle.dumps(m)
    # What happens to the files afterwards changes nothing, and the effects came along.
    shutil.rmtree(tmp_path)
    again = pickle.loads(pickled)
    assert again == m and hash(again) == hash(m) and copy.deepcopy(m) == m
    after = again.simulate({"time [s]": [0.0, 60.0], "q_in [lpm]": [300.0, 300.0]})
    assert (before["h"] == after["h"]).all()
    assert "q_l" in again.changed(apply=["leak"]).parameters
    assert again != again.changed(params={"k": 311}) and again != "tank"


def test_a_pickle_of_another_version_warns() -> None:
    m = dgd.parse("model m\nstate x [1] = 1\nequation e: 1 [s] * der(x) = -x\n")
    make, arguments = m.__reduce__()
    with pytest.warns(dgd.DgdWarning, match="pickled by dgd 0.0.9"):
        assert make("0.0.9", *arguments[1:]) == m
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(*arguments)


def test_no_panic_gets_through() -> None:
    for in_thread in (False, True):
        with pytest.raises(dgd.InternalError, match="guard.rs.*asked for by a test"):
            dgd._dgd.panic_for_test(in_thread)  # type: ignore[attr-defined]


def test_the_command_comes_along_and_needs_no_numpy() -> None:
    block = "import sys; sys.modules['numpy'] = None; sys.argv = ['dgd', *sys.argv[1:]]; "
    line = [sys.executable, "-c", block + "from dgd.__main__ import main; sys.exit(main())"]
    done = subprocess.run([*line, "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, f"dgd {dgd.__version__}\n"), done.stderr
    checked = subprocess.run([*line, "check", MODEL], capture_output=True, text=True, check=False)
    assert checked.returncode == 0 and "is sound" in checked.stderr
    wrong = subprocess.run([*line, "chekc"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2 and "chekc" in wrong.stderr
    missing = subprocess.run([*line, "check", "none.dgd"], capture_output=True, text=True, check=False)
    assert missing.returncode == 1 and "none.dgd" in missing.stderr
