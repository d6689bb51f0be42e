"""Frames of other packages, where these are installed: in, and out with their units."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import DATA, MODEL, Columns

import dgd

FIRST = np.datetime64("2026-11-21T10:57:00", "ns")


def bare(data: Columns) -> dict[str, np.ndarray]:
    """Columns by name alone, the time left out."""
    return {header.split(" ")[0]: values for header, values in data.items() if header != "time [s]"}


def units(data: Columns) -> dict[str, str]:
    """Units by name."""
    return {header.split(" ")[0]: header.split("[")[1][:-1] for header in data}


def stamps(data: Columns) -> np.ndarray:
    """Times as stamps."""
    return FIRST + (data["time [s]"] * 1e9).astype("timedelta64[ns]")


def check(found: dgd.Simulation, expected: dgd.Simulation) -> None:
    for name in expected:
        assert np.array_equal(found[name], expected[name]), name


def test_pandas_in_and_out(circulation: Columns) -> None:
    pandas = pytest.importorskip("pandas")
    m = dgd.load(MODEL)
    plain = m.simulate(circulation)
    frame = pandas.DataFrame(circulation)
    check(m.simulate(frame), plain)
    check(m.simulate(frame.set_index("time [s]")), plain)
    names = pandas.DataFrame({"time": circulation["time [s]"], **bare(circulation)})
    check(m.simulate(names, units=units(circulation)), plain)
    names.attrs["units"] = units(circulation)
    check(m.simulate(names), plain)
    # Stamps in the index, with a zone; the frame is called something.
    clock = pandas.DatetimeIndex(stamps(circulation)).tz_localize("UTC").tz_convert("Europe/Oslo")
    named = pandas.DataFrame(bare(circulation), index=clock)
    named.attrs.update(units=units(circulation), name="well 7")
    of_stamps = m.simulate(named)
    check(of_stamps, plain)
    assert of_stamps.name == "well 7" and of_stamps.provenance["data"][0]["file"] == "well 7"
    out = of_stamps.to_pandas()
    assert out.attrs["units"]["p_r"] == "bara" and (out.index == pandas.DatetimeIndex(stamps(circulation))).all()
    assert np.array_equal(out["p_r"].to_numpy(), plain["p_r"])
    check(m.simulate(out), plain)
    assert plain.to_pandas().index.name == "time [s]"
    # Missing values of pandas' own types.
    some = frame.astype({"p_r [bara]": "Float64"})
    some.loc[3, "p_r [bara]"] = pandas.NA
    assert m.fit(some.iloc[:600], noise="declared").result["samples"] == 4 * 600 - 1
    some["w_ssp [%]"] = some["w_ssp [%]"].astype("Float64")
    some.loc[5, "w_ssp [%]"] = pandas.NA
    with pytest.raises(dgd.DataError, match="(?s)`w_ssp` has no value here.*row 5"):
        m.simulate(some)
    durations = pandas.to_timedelta(circulation["time [s]"], unit="s")
    check(m.simulate(pandas.DataFrame(bare(circulation), index=durations), units="declared"), plain)


def test_polars_in_and_out(circulation: Columns) -> None:
    polars = pytest.importorskip("polars")
    m = dgd.load(MODEL)
    plain = m.simulate(circulation)
    frame = polars.DataFrame(circulation)
    check(m.simulate(frame), plain)
    reading = polars.when(polars.col("time [s]") == 3).then(None).otherwise(polars.col("p_r [bara]"))
    gap = frame.with_columns(reading.alias("p_r [bara]"))
    check(m.simulate(gap), plain)
    assert m.fit(gap.head(600), noise="declared").result["samples"] == 4 * 600 - 1
    clock = polars.DataFrame({"time": stamps(circulation), **bare(circulation)})
    clock = clock.with_columns(polars.col("time").dt.replace_time_zone("UTC"))
    of_stamps = m.simulate(clock, units="declared")
    check(of_stamps, plain)
    out = plain.to_polars()
    assert out.columns[:2] == ["time [s]", "w_ssp [%]"] and out["p_r [bara]"].to_list() == plain["p_r"].tolist()
    check(m.simulate(out), plain)
    assert of_stamps.to_polars().schema["time"] == polars.Datetime("ns")


def test_arrow_in_and_out(circulation: Columns) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    m = dgd.load(MODEL)
    plain = m.simulate(circulation)
    check(m.simulate(pyarrow.table(circulation)), plain)
    out = plain.to_arrow()
    assert out.schema.field("p_r").metadata == {b"unit": b"bara"} and out.schema.field("time").metadata == {b"unit": b"s"}
    check(m.simulate(out), plain)
    (batch,) = out.combine_chunks().to_batches()
    check(m.simulate(batch), plain)
    clock = pyarrow.table({"time": stamps(circulation), **bare(circulation)})
    of_stamps = m.simulate(clock, units="declared")
    check(of_stamps, plain)
    assert pyarrow.types.is_timestamp(of_stamps.to_arrow().schema.field("time").type)


def test_xarray_in_and_out(circulation: Columns) -> None:
    xarray = pytest.importorskip("xarray")
    m = dgd.load(MODEL)
    plain = m.simulate(circulation)
    variables = {name: ("time", values, {"units": units(circulation)[name]}) for name, values in bare(circulation).items()}
    dataset = xarray.Dataset(variables, coords={"time": ("time", circulation["time [s]"], {"units": "s"})})
    check(m.simulate(dataset), plain)
    of_stamps = m.simulate(dataset.assign_coords(time=stamps(circulation)))
    check(of_stamps, plain)
    out = of_stamps.to_xarray()
    assert out["p_r"].attrs == {"units": "bara", "kind": "output"} and out["h_r"].dims == ("time",)
    assert np.array_equal(out["time"].values, stamps(circulation))
    check(m.simulate(out), plain)
    s = m.sensitivity(dataset, of=["p_r", "h_r"], to=["c0", "F2"], until=60).to_xarray()
    assert s["sensitivity"].dims == ("time", "of", "to") and s["unit"].sel(of="p_r", to="c0") == "bara/m"
    direct = m.sensitivity(circulation, of="p_r", to="c0", until=60)["p_r", "c0"]
    assert np.array_equal(s["sensitivity"].sel(of="p_r", to="c0"), direct)


def test_matlab_and_las_files_by_packages_that_read_them(circulation: Columns, tmp_path: object) -> None:
    scipy_io = pytest.importorskip("scipy.io")
    lasio = pytest.importorskip("lasio")
    m = dgd.load(MODEL)
    plain = m.simulate(circulation)
    mat, las = f"{tmp_path}/run.mat", f"{tmp_path}/run.las"
    scipy_io.savemat(mat, {"time": circulation["time [s]"], **bare(circulation)})
    read = {name: values.ravel() for name, values in scipy_io.loadmat(mat).items() if not name.startswith("__")}
    check(m.simulate(read, units="declared"), plain)
    written = lasio.LASFile()
    written.append_curve("time", circulation["time [s]"], unit="s")
    for name, values in bare(circulation).items():
        written.append_curve(name, values, unit=units(circulation)[name])
    with open(las, "w", encoding="utf-8") as file:
        written.write(file, fmt="%.10g")
    log = lasio.read(las, mnemonic_case="preserve")
    read = {f"{curve.mnemonic} [{curve.unit}]": curve.data for curve in log.curves}
    assert np.allclose(m.simulate(read)["p_r"], plain["p_r"], rtol=1e-9)


def test_files_are_read_as_the_command_reads_them(tmp_path: object) -> None:
    m = dgd.load(MODEL)
    r = m.simulate(DATA / "circulation.csv")
    assert r.name == "circulation.csv"
    with pytest.raises(dgd.UsageError, match="a file has its units"):
        m.simulate(DATA / "circulation.csv", units={"p_r": "bar"})
    with pytest.raises(dgd.DataError, match="cannot read"):
        m.simulate(f"{tmp_path}/none.csv")
