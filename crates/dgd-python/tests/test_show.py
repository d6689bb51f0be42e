"""What a person sees: pictures in the colours of the reports, cells of notebooks, bars."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import MODEL, ROOT, Columns

import dgd

BLUE, BLACK_TINTED = "#0072b2", (0.35, 0.35, 0.35)


def test_results_plot_themselves_in_the_colours_of_the_reports(circulation: Columns, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from matplotlib.colors import to_hex, to_rgb

    m = dgd.load(MODEL)
    short = {name: values[:900] for name, values in circulation.items()}
    r = m.simulate(short)
    figure = r.plot()
    panels = {axes.get_title(loc="left"): axes for axes in figure.axes}
    level = panels["$\\mathregular{h_{r}}$"]
    assert to_hex(level.lines[0].get_color()) == BLUE and np.array_equal(level.lines[0].get_ydata(), r["h_r"])
    simulated, measured = panels["$\\mathregular{p_{r}}$"].lines
    assert to_hex(simulated.get_color()) == BLUE and np.allclose(to_rgb(measured.get_color()), BLACK_TINTED)
    assert np.array_equal(measured.get_ydata(), short["p_r [bara]"])
    assert panels["$\\mathregular{p_{r}}$"].get_ylabel() == "[bara]" and measured.get_zorder() < simulated.get_zorder()
    f = m.fit(short, noise="declared", profile="c0")
    s = m.sensitivity(short, of="p_r", to="c0")
    for k, one in enumerate([figure, f.plot(), f.profile("c0")["c0"].plot(), s.plot()]):
        path = tmp_path / f"{k}.png"
        one.savefig(path)
        assert path.stat().st_size > 10_000 and one._repr_png_().startswith(b"\x89PNG")


def test_arrays_are_drawn_over_place_and_time() -> None:
    pytest.importorskip("matplotlib")
    m = dgd.load(ROOT / "models" / "transmission_line.dgd")
    inputs = {"time [s]": [0.0, 5.0], "q_in [lpm]": [2000.0, 2200.0], "p_out [bar]": [10.0, 10.0]}
    figure = m.simulate(inputs, every=0.1).plot()
    meshes = [mesh for axes in figure.axes for mesh in axes.collections if mesh.get_array() is not None]
    assert any(mesh.get_array().shape == (10, 51) for mesh in meshes), [mesh.get_array().shape for mesh in meshes]


def test_a_cell_is_a_model(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("IPython")
    from IPython.testing.globalipapp import start_ipython

    shell = start_ipython()
    shell.run_line_magic("load_ext", "dgd")
    cell = "model m\nparameter tau [s] = 3\nstate x [1] = 1\nequation e: tau*der(x) = -x\n"
    shown = shell.run_cell_magic("dgd", "decay", cell)
    assert shown.name == "m" and shell.user_ns["decay"] is shown
    assert shell.run_cell_magic("dgd", "", cell) is shell.user_ns["model"]
    assert shell.run_cell_magic("dgd", "decay", cell.replace("tau*", "ta*")) is None
    assert "did you mean `tau`" in "".join(capsys.readouterr())
    with pytest.raises(dgd.UsageError, match="%%dgd NAME"):
        shell.run_cell_magic("dgd", "two words", cell)


def test_bars_are_those_of_tqdm(circulation: Columns, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    m = dgd.load(MODEL)
    m.fit([circulation] * 4, starts=24, progress=True)
    shown = capsys.readouterr().err
    assert "starts:" in shown and "/24 [" in shown, shown
    m.fit([circulation], progress=False)
    assert capsys.readouterr().err == ""
