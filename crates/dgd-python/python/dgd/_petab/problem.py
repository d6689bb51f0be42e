"""A problem of PEtab as a model and its recordings."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import _dgd
from .._errors import DataError, ModelError, UsageError, warn
from .._model.model import Model, parse
from .._options import Values
from .._results.fit import Fit
from .read.tables import Tables
from .model import Written
from .recordings import Columns, Reading, recordings, restless
from .refusal import Refusals

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import RunOptions
    from .._points import Objective

_NOISE = ("declared", "estimated")


def from_petab(
    path: str | os.PathLike[str], *, noise: str = "declared", settle: float | None = None
) -> PetabProblem:
    """Reads a PEtab problem, by its YAML file, as a model and recordings.

    It needs ``pip install 'dgd-models[petab]'``. With ``noise="declared"`` outputs get the noise of the
    observable table, with ``"estimated"`` they get none, so a fit estimates one standard deviation for
    each.

    ``settle`` is the duration of pre-equilibration, in the model's unit of time: such an experiment begins with a run-in
    of this length under its first condition. Measurements at the steady state are taken that long after all others.
    A warning names states that still move then.

    Raises :class:`ModelError`, which lists all unsupported constructs, `OSError` if there is
    no such file, and :class:`DataError` if petab cannot read it.
    """
    if noise not in _NOISE:
        raise UsageError(f'`noise` must be "declared" or "estimated", not {noise!r}')
    try:
        import libsbml  # noqa: F401
        import petab  # noqa: F401
    except ImportError as error:
        raise ImportError(f"{error}; `pip install 'dgd-models[petab]'` brings what PEtab needs") from error
    file = os.fspath(path)
    with open(file, "rb"):
        pass
    if settle is not None and not settle > 0:
        raise UsageError(f"`settle` must be a time above zero, not {settle!r}")
    return _read(file, noise == "declared", settle)


def _read(file: str, is_noise_declared: bool, settle: float | None) -> PetabProblem:
    # They need libSBML.
    from .build import written
    from .read.sbml import network

    refusals = Refusals()
    what = f"the PEtab problem {os.path.basename(file)}"
    found = _tables(file, what, refusals)
    if not found.measurements:
        raise DataError(f"{what} has no measurements")
    is_all = all(one.before is not None for one in found.experiments.values())
    is_steady = settle is None and is_all
    ends = {one.experiment for one in found.measurements if one.time == math.inf}
    if settle is not None or is_steady:
        # At rest it does not matter how long nothing moves.
        found.settle(1.0 if settle is None else settle, settle)
    whole = written(network(found.document, refusals), found, is_noise_declared, refusals)
    whole.is_steady = is_steady
    refusals.raise_if_any(what)
    columns, readings = recordings(whole, found, refusals)
    refusals.raise_if_any(what)
    model = _model(whole, what)
    for which, one in found.experiments.items():
        if one.run_in and not is_steady:
            _warn_of(restless(model, columns[which], 1), f"at the end of the run-in of `{which}`")
        if which in ends:
            _warn_of(restless(model, columns[which], -1), f"at the end of `{which}`")
    return PetabProblem(model, columns, readings, found.frame)


def _warn_of(moving: list[str], place: str) -> None:
    """Warns of states that are not at rest."""
    if moving:
        said = ", ".join(f"`{state}`" for state in moving)
        warn([f"not at rest {place}: {said}; give a longer `settle`"], stacklevel=4)


def _model(whole: Written, what: str) -> Model:
    """Compiles the model from its text."""
    try:
        return parse(whole.text(), name=f"{whole.names.of(whole.name)}.dgd")
    except ModelError as error:
        if not (whole.is_steady and [one.code for one in error.diagnostics] == ["E508"]):
            raise
        refusals = Refusals()
        refusals.add(f"pre-equilibration of a model that reads the time, unless `settle` is given: {error}")
        refusals.raise_if_any(what)
        raise


def _tables(file: str, what: str, refusals: Refusals) -> Tables:
    """The tables, read by the reader of their version."""
    import petab.v1
    import petab.v2
    import yaml
    from petab.versions import get_major_version

    from .read import first, second

    try:
        config = yaml.safe_load(Path(file).read_text(encoding="utf-8"))
        is_first = get_major_version(config) == 1
        with warnings.catch_warnings():
            # Of what petab calls in other packages, its users can change nothing.
            warnings.simplefilter("ignore", DeprecationWarning)
            warnings.simplefilter("ignore", FutureWarning)
            problem = (petab.v1 if is_first else petab.v2).Problem.from_yaml(file)
    # Those of YAML, JSON Schema, pandas and pydantic have nothing else in common.
    except Exception as error:
        raise DataError(f"{what} cannot be read by petab: {error}") from error
    return first.tables(problem, refusals) if is_first else second.tables(problem, refusals)


class PetabProblem:
    """A PEtab problem: a model, and one recording per experiment.

    >>> p = dgd.from_petab("Boehm.yaml")
    >>> f = p.fit(starts=20)
    >>> p.save("boehm")          # for `dgd fit boehm/Boehm.dgd --data boehm/*.csv --noise declared`
    """

    def __init__(self, model: Model, recordings: dict[str, Columns], readings: list[Reading], frame: Any) -> None:
        #: The model.
        self.model = model
        #: Recordings by experiment: columns by header.
        self.recordings = recordings
        self._readings, self._frame = readings, frame

    @property
    def text(self) -> str:
        """The model's text."""
        return self.model.text

    def fit(self, **options: Any) -> Fit:
        """Fits the model to all recordings; options are those of :meth:`Model.fit`, with declared noise."""
        return self.model.fit(self.recordings, **{"noise": "declared", **options})

    def objective(self, **options: Any) -> Objective:
        """The objective of a fit; options are those of :meth:`Model.objective`."""
        return self.model.objective(self.recordings, **options)

    def simulation(self, params: Values = None, **run: Unpack[RunOptions]) -> Any:
        """The measurement table of the problem with a column ``simulation`` in place of ``measurement``.

        Simulated values are those of the observables, not of their logarithms. ``params`` overrides values
        of the parameter table; other options are those of :meth:`Model.simulate`.
        """
        runs = {
            which: self.model.simulate(columns, params=params, **run) for which, columns in self.recordings.items()
        }
        values = [one.unscaled(float(runs[one.recording][one.output][one.row])) for one in self._readings]
        frame = self._frame.drop(columns="measurement")
        frame.insert(self._frame.columns.get_loc("measurement"), "simulation", values)
        return frame

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Writes the model and a CSV file for each recording into a folder, which is created. Returns their paths.

        The model is laid out as ``dgd fmt`` does.
        """
        into = Path(folder)
        into.mkdir(parents=True, exist_ok=True)
        paths = [into / Path(self.model.path).name]
        paths[0].write_text(_dgd.laid_out(self.text), encoding="utf-8")
        for which, columns in self.recordings.items():
            paths.append(into / f"{which}.csv")
            paths[-1].write_text(_csv(columns), encoding="utf-8")
        return paths

    def __repr__(self) -> str:
        count = len(self._readings)
        return f"<dgd.PetabProblem {Path(self.model.path).stem}: {len(self.recordings)} recordings, {count} readings>"


def _csv(columns: Mapping[str, Any]) -> str:
    """Columns as a CSV file; a missing value is an empty cell."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join("" if value != value else repr(value).removesuffix(".0") for value in row) for row in rows]
    return "\n".join([",".join(columns), *lines]) + "\n"
