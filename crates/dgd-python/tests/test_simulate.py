"""Simulations: to the last bit what the command writes, from whatever the numbers come."""

from __future__ import annotations

import html
import json
import os
import threading
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from conftest import DATA, MODEL, Columns

import dgd

CSV = str(DATA / "circulation.csv")


@pytest.mark.parametrize("engine", ["auto", "native", "interpreter"])
def test_numbers_are_those_of_the_command_to_the_last_bit(
    engine: str, circulation: Columns, command: Callable[..., str]
) -> None:
    m = dgd.load(MODEL, variant={"flow": "static"}, apply=["pump_wear"])
    r = m.simulate(circulation, params={"c0": 280.0}, start={"h_r": 48}, engine=engine)
    line = ["simulate", MODEL, "--data", CSV, "--variant", "flow=static", "--apply", "pump_wear", "--set", "c0=280"]
    text = command(*line, "--set", "h_r=48", "--engine", engine)
    assert r.to_csv() == text
    # The arrays are what the text says.
    rows = [line.split(",") for line in text.splitlines()]
    for k, header in enumerate(rows[0][1:], 1):
        name = header.split(" ")[0]
        written = np.array([float(row[k]) for row in rows[1:]])
        assert np.allclose(r[name], written, rtol=1e-15, atol=0) and header == f"{name} [{r.units[name]}]"
    assert r["h_r"][0] == 48.0 and len(r.time) == 3601


def test_files_dictionaries_arrays_and_results_are_recordings(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    of_file = m.simulate(CSV)
    names = {header.split(" ")[0]: values for header, values in circulation.items()}
    units = {header.split(" ")[0]: header.split("[")[1][:-1] for header in circulation}
    structured = np.rec.fromarrays(list(names.values()), names=list(names)).view(np.ndarray)
    for same in (
        m.simulate(circulation),
        m.simulate(names, units=units),
        m.simulate(names, units="declared"),
        m.simulate(structured, units=units),
        m.simulate({**names, "notes": ["none"] * 3601}, units=units),
    ):
        for name in of_file:
            assert np.array_equal(same[name], of_file[name]), name
    # What was simulated drives another run: the inputs are the same, the states are ignored.
    again = m.simulate(of_file)
    assert np.array_equal(again["h_r"], of_file["h_r"])
    assert of_file.to_dict()["p_r"] is of_file["p_r"]
    assert of_file.to_numpy()["p_r"].tolist() == of_file["p_r"].tolist()


def test_units_are_converted_or_refused(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    plain = m.simulate(circulation)
    flow = circulation["q_boost [lpm]"]
    other = {key: values for key, values in circulation.items() if not key.startswith(("q_boost", "p_r"))}
    converted = m.simulate({**other, "q_boost": flow / 60000}, units={"q_boost": "m^3/s"})
    assert np.allclose(converted["h_r"], plain["h_r"], rtol=1e-12)
    with pytest.raises(dgd.DataError, match='units={"q_boost"') as raised:
        m.simulate({**other, "q_boost": flow})
    assert [one.code for one in raised.value.diagnostics] == ["E609"]
    with pytest.raises(dgd.DataError, match="does not convert"):
        m.simulate({**other, "q_boost": flow}, units={"q_boost": "bar"})
    with pytest.raises(dgd.UsageError, match="did you mean `q_boost`"):
        m.simulate({**other, "q_boost": flow}, units={"q_bost": "lpm"})
    with pytest.raises(dgd.DataError, match="does not hold numbers"):
        m.simulate({**other, "q_boost": ["much"] * len(flow)})
    with pytest.raises(dgd.DataError, match="differ in length"):
        m.simulate({**other, "q_boost [lpm]": flow[:-1]})
    renamed = m.simulate({**other, "Q_B": flow}, rename={"Q_B": "q_boost [lpm]"})
    assert np.array_equal(renamed["h_r"], plain["h_r"])


def test_columns_that_nobody_knows_are_warned_of(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    with pytest.warns(dgd.DgdWarning, match="does not know the column `hook_load`"):
        r = m.simulate({**circulation, "hook_load [kN]": circulation["time [s]"]})
    assert len(r.remarks) == 1


def test_times_may_be_stamps(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    plain = m.simulate(circulation)
    rest = {key: values for key, values in circulation.items() if key != "time [s]"}
    first = np.datetime64("2026-11-21T10:57:00.5", "ns")
    stamps = first + (circulation["time [s]"] * 1e9).astype("timedelta64[ns]")
    r = m.simulate({"time": stamps, **rest})
    assert np.array_equal(r.time, plain.time) and np.array_equal(r["p_r"], plain["p_r"])
    assert r.stamps is not None and np.array_equal(r.stamps, stamps) and plain.stamps is None
    assert np.array_equal(r.to_dict()["time"], stamps)
    # Objects with another zone, and texts.
    zone = timezone(timedelta(hours=2))
    begin = datetime(2026, 11, 21, 12, 57, 0, 500_000, zone)
    objects = [begin + timedelta(seconds=float(t)) for t in circulation["time [s]"]]
    for clock in (objects, [one.isoformat() for one in objects], [one - begin for one in objects]):
        same = m.simulate({"time": clock, **rest})
        assert np.array_equal(same["p_r"], plain["p_r"])
    minutes = m.simulate({"time [min]": circulation["time [s]"] / 60, **rest})
    assert np.allclose(minutes.time, plain.time, rtol=1e-12)
    with pytest.raises(dgd.DataError, match="(?s)time runs backwards.*row 1"):
        m.simulate({"time": stamps[::-1], **rest})


def test_a_run_that_ends_on_its_way_has_what_it_reached() -> None:
    m = dgd.parse("model m\nstate x [1] = 1\nequation e: 1 [s] * der(x) = x^2\noutput y [1] = 2*x\n")
    with pytest.raises(dgd.SimulationError, match="`partial`") as raised:
        m.simulate(until=2.0, every=0.07)
    part = raised.value.partial
    assert isinstance(part, dgd.Simulation) and 0.8 < part.time[-1] < 1.0
    assert np.allclose(part["x"], 1 / (1 - part.time), rtol=1e-4) and "stopped" not in part
    with pytest.raises(dgd.SimulationError) as raised:
        m.sensitivity(until=2.0, every=0.1, to="x")
    assert isinstance(raised.value.partial, dgd.Sensitivity)


def test_runs_begin_where_the_command_has_them_begin(circulation: Columns, command: Callable[..., str]) -> None:
    m = dgd.load(MODEL)
    line = ["simulate", MODEL, "--data", CSV, "--until", "60"]
    measured = m.simulate(circulation, start="measured", until=60)
    assert measured.to_csv() == command(*line, "--start", "measured")
    assert measured["h_r"][0] != m.simulate(circulation, until=60)["h_r"][0]
    later = m.simulate(circulation, from_=30, until=60, every=0.5, start={"q_ssp": (0.03, "m^3/s")})
    assert later.to_csv() == command(*line, "--from", "30", "--every", "0.5", "--set", "q_ssp=0.03 [m^3/s]")


def test_a_table_is_saved_in_the_format_of_its_name(circulation: Columns, tmp_path: Path) -> None:
    r = dgd.load(MODEL).simulate(circulation, until=60)
    r.save(tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text() == r.to_csv()
    r.save(tmp_path / "run.json")
    assert json.loads((tmp_path / "run.json").read_text())["method"] == r.method
    with pytest.raises(dgd.UsageError, match="a table is written as .csv, .parquet, .json or .jsonl"):
        r.save(tmp_path / "run.xlsx")


def test_options_are_checked(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    with pytest.raises(TypeError, match="did you mean `rtol`"):
        m.simulate(circulation, rtoll=1e-3)  # type: ignore[call-arg]
    with pytest.raises(dgd.UsageError, match='`engine` must be "auto" or'):
        m.simulate(circulation, engine="fast")
    with pytest.raises(dgd.UsageError, match="`rtol` must be a number above 0"):
        m.simulate(circulation, rtol=-1)
    with pytest.raises(dgd.UsageError, match="`until`: the run would end"):
        m.simulate(circulation, until=-3)
    with pytest.raises(dgd.UsageError, match="`data=FILE`"):
        m.simulate()
    with pytest.raises(dgd.UsageError, match="not an array without names"):
        m.simulate(np.zeros((3, 4)))
    with pytest.raises(KeyError, match="there is `w_ssp`"):
        m.simulate(circulation, until=10)["p"]
    tight = m.simulate(circulation, until=600.0, rtol=1e-9, method="tsit5", every=60)
    assert tight.method == "tsit5" and len(tight.time) == 11
    noisy = m.simulate(circulation, noise_seed=3, until=600)
    assert 0.005 < np.std(noisy["p_r"] - m.simulate(circulation, until=600)["p_r"]) < 0.02


def test_a_model_is_shared_between_threads(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    expected = [m.simulate(circulation, params={"c0": 270.0 + k})["p_r"] for k in range(8)]
    found: list[np.ndarray | None] = [None] * 8

    def run(k: int) -> None:
        found[k] = m.simulate(circulation, params={"c0": 270.0 + k})["p_r"]

    threads = [threading.Thread(target=run, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one, other in zip(found, expected, strict=True):
        assert one is not None and np.array_equal(one, other)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_model_goes_on_in_a_process_that_was_forked(circulation: Columns) -> None:
    m = dgd.load(MODEL)
    expected = m.simulate(circulation, until=60.0)["p_r"]
    child = os.fork()
    if child == 0:
        # Whatever happens, the tests do not go on here.
        code = 1
        try:
            code = 0 if np.array_equal(m.simulate(circulation, until=60.0)["p_r"], expected) else 2
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0


def test_a_page_has_the_line_that_makes_it_again(circulation: Columns, tmp_path: Path) -> None:
    m = dgd.load(MODEL, variant={"flow": "static"})
    page = m.simulate(circulation, params={"c0": 280}, until=60.0).report()
    line = f"dgd.load({MODEL!r}, variant={{'flow': 'static'}}).simulate('data', params={{'c0': 280}}, until=60.0)"
    assert line in html.unescape(page.html)
    assert page._repr_html_().startswith("<iframe")
    page.save(tmp_path / "run.html")
    assert (tmp_path / "run.html").read_text() == page.html
