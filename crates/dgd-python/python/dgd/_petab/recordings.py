"""Measurements as recordings, one per experiment."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._model.model import Model
from .model import Written
from .read.tables import Measurement, Tables
from .refusal import Refusals

Columns = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Reading:
    """Position of a measurement: its recording, row and column; and the logarithm applied to it."""

    recording: str
    row: int
    output: str
    scale: str

    def unscaled(self, value: float) -> float:
        """A value of the output as one of the observable."""
        if self.scale == "log10":
            return float(10.0**value)
        return math.exp(value) if self.scale == "log" else value


def recordings(
    written: Written, tables: Tables, refusals: Refusals
) -> tuple[dict[str, Columns], list[Reading]]:
    """Recordings by experiment, as columns by header, and the position of each measurement."""
    found: dict[str, Columns] = {}
    readings: dict[int, Reading] = {}
    label, size = written.time_label
    for experiment, whole in tables.experiments.items():
        rows = [k for k, one in enumerate(tables.measurements) if one.experiment == experiment]
        starts = [phase.start for phase in whole.phases]
        times = _rows(rows, starts, whole.run_in, tables, written, refusals, readings, experiment)
        columns = {f"time [{label}]": size * np.array(times)}
        phases = [sum(start <= time for start in starts) - 1 for time in times]
        for one in written.inputs:
            values = [written.columns[experiment, phase][one] for phase in phases]
            columns[f"{written.names.of(one)} [1]"] = np.array(values)
        for output in dict.fromkeys(written.places[k].name for k in rows):
            columns[f"{output} [1]"] = np.full(len(times), math.nan)
        for k in rows:
            where = readings[k]
            measurement = tables.measurements[k]
            _refuse_without_logarithm(measurement, tables, refusals)
            columns[f"{where.output} [1]"][where.row] = _scaled(measurement.value, where.scale)
        found[experiment] = columns
    return found, [readings[k] for k in sorted(readings)]


def _rows(
    rows: list[int],
    starts: list[float],
    run_in: float,
    tables: Tables,
    written: Written,
    refusals: Refusals,
    readings: dict[int, Reading],
    experiment: str,
) -> list[float]:
    """Times of rows. Each output has one measurement per row; a phase starts with a row, measured or not."""
    counts: dict[float, dict[str, list[int]]] = {start: {} for start in starts}
    for k in rows:
        time = tables.measurements[k].time
        if not (math.isfinite(time) and time >= 0):
            which = f"at the time `{time}`, in the experiment `{experiment}`"
            if time == math.inf:
                which = f"at the steady state, in the experiment `{experiment}`, unless `settle` is given"
            refusals.add(f"measurements {which}")
            time = 0.0
        counts.setdefault(run_in + time, {}).setdefault(written.places[k].name, []).append(k)
    times: list[float] = []
    for time, by_output in sorted(counts.items()):
        for output, members in by_output.items():
            for replicate, k in enumerate(members):
                readings[k] = Reading(experiment, len(times) + replicate, output, written.places[k].scale)
        count = max(map(len, by_output.values()), default=1)
        # Two rows with one time would be the values left and right of a jump; three are replicates.
        times += [time] * (3 if count == 2 else count)
    return times


def _refuse_without_logarithm(measurement: Measurement, tables: Tables, refusals: Refusals) -> None:
    if tables.observables[measurement.observable].scale != "lin" and measurement.value <= 0:
        value = f"{measurement.value:g}"
        refusals.add(f"the measurement {value} of `{measurement.observable}`, which has no logarithm")


def _scaled(value: float, scale: str) -> float:
    if scale == "lin":
        return value
    if not value > 0:
        return math.nan
    return math.log10(value) if scale == "log10" else math.log(value)


def restless(model: Model, columns: Columns, row: int) -> list[str]:
    """States that still move at a row of a recording, at the values of the model.

    They differ there by more than a millionth of their size from their values half way since the previous row.
    """
    header, times = next(iter(columns.items()))
    row = int(np.searchsorted(times, times[row]))
    # What holds from the row before on, up to this one.
    kept = [*range(row), row - 1, row - 1]
    inputs = {one: values[kept] for one, values in columns.items() if one.partition(" [")[0] in model.inputs}
    middle = (times[row - 1] + times[row]) / 2
    run = model.simulate({header: np.array([*times[:row], middle, times[row]]), **inputs}, rtol=1e-9)
    values = {one: run[one] for one in model.states}
    return [one for one, x in values.items() if abs(x[-1] - x[-2]) > 1e-6 * np.abs(x).max()]
