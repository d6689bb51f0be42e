"""Models: loading them, and what can be asked of them."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _dgd
from ._data.bytes import Array, array, packed
from ._data.columns import Prepared
from ._data.incoming import apart, recording, recordings
from ._declared import Declared
from ._errors import DgdWarning, SimulationError, UsageError, warn
from ._options import Names, Start, Values, choices, names, native, settings
from ._points import Objective, Problem
from ._results.discovery import Discovery
from ._results.fit import Fit
from ._results.series import Sensitivity, Simulation
from ._show.progress import Progress, Shown
from ._track import Tracker

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import RunOptions


def load(
    path: str | os.PathLike[str],
    *,
    variant: Mapping[str, str] | None = None,
    params: Values = None,
    apply: str | Sequence[str] = (),
) -> Model:
    """Reads a model file, checks it in all its variants and compiles it.

    ``variant`` chooses variants, as in ``{"flow": "static"}``; ``params`` sets parameters, constants, sizes and start
    values; ``apply`` lists effects: files, or names from the folder ``effects`` beside the model, with arguments in
    parentheses.

    Raises :class:`ModelError` with the mistakes, and `OSError` where there is no such file.
    """
    # What cannot be opened raises what Python says of it.
    with open(path, "rb"):
        pass
    return _loaded(os.fspath(path), [], choices(variant), settings(params), _effects(apply))


def parse(
    text: str,
    *,
    name: str = "model.dgd",
    variant: Mapping[str, str] | None = None,
    params: Values = None,
    apply: str | Sequence[str] = (),
) -> Model:
    """The same of a text. ``name`` is what mistakes call it, and where its imports and effects are looked for."""
    texts = [(name, text.encode())]
    return _loaded(name, texts, choices(variant), settings(params), _effects(apply))


def _effects(apply: str | Sequence[str]) -> list[str]:
    return [apply] if isinstance(apply, str) else list(apply)


def _loaded(
    path: str, texts: list[tuple[str, bytes]], variant: list[str], set: list[str], apply: list[str]
) -> Model:
    model = Model(_dgd.load(path, texts, variant, set, apply))
    warn(model._native.remarks, stacklevel=3)
    return model


def _restored(
    version: str, path: str, texts: list[tuple[str, bytes]], variant: list[str], set: list[str], apply: list[str]
) -> Model:
    """A model from what a pickle has of it."""
    if version != _dgd.__version__:
        words = f"the model was pickled by dgd {version} and is compiled by {_dgd.__version__}: numbers may differ"
        warnings.warn(words, DgdWarning, stacklevel=2)
    return Model(_dgd.load(path, texts, variant, set, apply))


class Model(Declared):
    """A model: what it declares, and what can be asked of it. It never changes, and any thread may use it.

    A pickle has its texts and options and the version of dgd. ``load`` and ``parse`` make one.
    """

    def __init__(self, native_model: _dgd.Model) -> None:
        super().__init__(native_model)
        self._plain: _dgd.Equations | None = None

    def changed(
        self,
        *,
        variant: Mapping[str, str] | None = None,
        params: Values = None,
        apply: str | Sequence[str] | None = None,
    ) -> Model:
        """Another model of the same texts: other variants and values beside those chosen, and other effects."""
        chosen, set_before, applied = self._native.choices
        kept = [one for one in chosen if one.split("=")[0] not in (variant or {})]
        left = [one for one in set_before if one.split("=")[0] not in (params or {})]
        effects = applied if apply is None else _effects(apply)
        return _loaded(self.path, self._native.texts, kept + choices(variant), left + settings(params), effects)

    def _with_text(self, text: str, is_whole: bool) -> Model:
        """The model with another text, which has effects and settings in it."""
        variant, set_before, _ = self._native.choices
        kept = {path: content for path, content in self._native.texts}
        kept[self.path] = text.encode()
        return Model(_dgd.load(self.path, list(kept.items()), variant, [] if is_whole else set_before, []))

    # What can be asked of it.

    def simulate(
        self,
        data: Any = None,
        *,
        params: Values = None,
        start: Start = None,
        every: float | None = None,
        noise_seed: int | None = None,
        **run: Unpack[RunOptions],
    ) -> Simulation:
        """States and outputs over time, driven by the inputs of a recording.

        ``data`` is a frame of pandas, polars, xarray or pyarrow, a dictionary of arrays, a structured array, an earlier
        simulation or the path of a file. Its columns are called as in the model, ``time`` among them, or the index is
        the time. Units come from attributes, from names as ``"p_r [bar]"``, or from ``units``. A model without inputs
        needs none, but ``until``.

        ``params`` sets parameters, constants and sizes, ``start`` start values, both in declared units; ``start=
        "measured"`` takes them from the first readings. ``every`` is the time between rows, s. ``noise_seed`` adds noise
        of the declared size to the outputs. The other options are those of :class:`dgd._options.RunOptions`: units,
        rename, from_, until, method, steps, rtol, atol, engine, seed, threads.

        Raises :class:`SimulationError`, whose ``partial`` has what was reached, :class:`DataError` and
        :class:`UsageError`.
        """
        options = native(run, params, start, every=every, noise_seed=noise_seed)
        given = self._recording(data, run)
        found = self._native.simulate(given.argument if given else None, options)
        origin, name = (given.origin, given.name) if given else (None, self.name)
        call = self._call("simulate", given, params=params, start=start, every=every, noise_seed=noise_seed, **run)
        result = Simulation(found, origin, name, call)
        warn(found.remarks)
        if found.stopped is not None:
            raise _stopped(found.stopped, result)
        return result

    def sensitivity(
        self,
        data: Any = None,
        *,
        of: Names = (),
        to: Names = (),
        scaled: bool = False,
        params: Values = None,
        start: Start = None,
        every: float | None = None,
        **run: Unpack[RunOptions],
    ) -> Sensitivity:
        """Derivatives of states and outputs ``of`` to parameters, or start values of states, ``to``, over time.

        All states and outputs, and all parameters, where nothing is named. ``scaled`` multiplies each derivative by its
        parameter. The rest is as for :meth:`simulate`.
        """
        options = native(run, params, start, every=every, of=names(of), to=names(to), scaled=scaled)
        given = self._recording(data, run)
        found = self._native.sensitivity(given.argument if given else None, options)
        origin, name = (given.origin, given.name) if given else (None, self.name)
        call = self._call("sensitivity", given, of=names(of), to=names(to), scaled=scaled, params=params, **run)
        result = Sensitivity(found, origin, name, call, scaled)
        warn(found.remarks)
        if found.stopped is not None:
            raise _stopped(found.stopped, result)
        return result

    def fit(
        self,
        data: Any,
        *,
        valid: Any = None,
        free: Names = (),
        fix: Names = (),
        outputs: Names = (),
        params: Values = None,
        start: Start = None,
        starts: int = 1,
        noise: str = "estimated",
        loss: str = "squares",
        estimator: str = "output-error",
        profile: Names = (),
        bootstrap: int = 0,
        information: bool = False,
        evaluations: int | None = None,
        smoothing: float | None = None,
        steady: Mapping[str, float] | None = None,
        progress: Progress = None,
        **run: Unpack[RunOptions],
    ) -> Fit:
        """Parameters and start values from recordings, tested on others.

        ``data`` and ``valid`` are lists of recordings, dictionaries of them by name, or one of them; what a recording
        can be is said at :meth:`simulate`. ``free`` and ``fix`` name parameters that are estimated, or not; ``outputs``
        those that are compared. ``params`` and ``start`` are first guesses. ``starts`` fits from so many starting points
        and keeps the best. ``noise`` is ``"estimated"`` or ``"declared"``, ``loss`` ``"squares"``, ``"huber"``,
        ``"cauchy"`` or ``"tukey"``, ``estimator`` one of ``dgd fit --estimator``. ``profile`` names estimates whose
        intervals are found by profile likelihood, ``bootstrap`` is a number of refits to resampled residuals.
        ``progress`` is ``True``, ``False``, or a function that is called with what is counted, how many are done, how
        many there will be, and whether that is only the most.

        Ctrl-C ends it with the best so far. A fit that ended in no minimum is a result with ``converged == False`` and a
        warning. Raises :class:`FitError` only where no point could be evaluated.
        """
        slow = [f"{name}={value!r}" for name, value in (steady or {}).items()]
        calls: dict[str, Any] = dict(
            free=names(free),
            fix=names(fix),
            outputs=names(outputs),
            starts=starts,
            noise=noise,
            loss=loss,
            estimator=estimator,
            profile=names(profile),
            bootstrap=bootstrap,
            information=information,
            evaluations=evaluations,
            smoothing=smoothing,
            steady=slow,
        )
        options = native(run, params, start, **calls)
        train, held_out = self._recordings(data, valid, run)
        options["command"] = self._call("fit", train, valid=held_out or None, params=params, start=start, **calls, **run)
        with Shown(progress) as shown:
            found = self._native.fit(_arguments(train), _arguments(held_out), options, shown.call)

        def profiled(model: Model, wanted: list[str]) -> Fit:
            more = {**options, "set": [], "profile": wanted, "starts": 1, "bootstrap": 0}
            again = model._native.fit(_arguments(train), _arguments(held_out), more, None)
            return model._fit(again, profiled)

        fitted = self._fit(found, profiled)
        warn([*found.remarks, *found.left_out])
        return fitted

    def _fit(self, found: _dgd.Fitted, profiled: Callable[[Model, list[str]], Fit]) -> Fit:
        folder = os.path.dirname(self.path) or "."
        return Fit(found, lambda text: self._with_text(text, is_whole=True), folder, profiled)

    def discover(
        self,
        data: Any,
        *,
        valid: Any = None,
        effects: str | Sequence[str] = (),
        free: Names = (),
        fix: Names = (),
        params: Values = None,
        start: Start = None,
        budget: float | None = None,
        progress: Progress = None,
        **run: Unpack[RunOptions],
    ) -> Discovery:
        """What the model lacks: where it and the recordings disagree, and which known effect is missing.

        ``data`` and ``valid`` are as for :meth:`fit`. ``effects`` lists folders of effects besides that beside the
        model. ``budget`` is how long it may take, s. Ctrl-C ends it with the best so far.
        """
        folders = [effects] if isinstance(effects, str) else [os.fspath(folder) for folder in effects]
        calls = dict(effects=folders, free=names(free), fix=names(fix), budget=budget)
        options = native(run, params, start, **calls)
        train, held_out = self._recordings(data, valid, run)
        options["command"] = self._call("discover", train, valid=held_out or None, params=params, **calls, **run)
        with Shown(progress) as shown:
            found = self._native.discover(_arguments(train), _arguments(held_out), options, shown.call)
        result = Discovery(found, lambda text: self._with_text(text, is_whole=False))
        cut_short = [words for words in found.reservations if found.is_cut_short and words.startswith("the search")]
        warn([*found.remarks, *cut_short])
        return result

    def track(
        self,
        *,
        estimator: str = "ekf",
        free: Names = (),
        fix: Names = (),
        outputs: Names = (),
        process_noise: Values = None,
        start_std: Values = None,
        noise: Values = None,
        forgetting: float | None = None,
        gate: float | None = None,
        params: Values = None,
        start: Start = None,
        **run: Unpack[RunOptions],
    ) -> Tracker:
        """States and parameters on line: ``t = m.track(); t.update(row)`` for each row as it comes.

        ``estimator`` is ``"ekf"``, ``"ukf"`` or ``"recursive"``. ``process_noise`` has standard deviations of random
        walks after one minute, ``start_std`` those at first, ``noise`` those of outputs, each by name and in declared
        units. Samples more than ``gate`` standard deviations from their prediction are ignored.
        """
        options = native(
            run,
            params,
            start,
            estimator=estimator,
            free=names(free),
            fix=names(fix),
            outputs=names(outputs),
            process_noise=settings(process_noise),
            start_std=settings(start_std),
            noise=settings(noise),
            forgetting=forgetting,
            gate=gate,
        )
        return Tracker(self._native.track(options), run.get("units"), self._declared())

    def problem(
        self, data: Any = None, *, params: Values = None, start: Start = None, **run: Unpack[RunOptions]
    ) -> Problem:
        """The equations with the inputs of a recording, point by point: ``rhs``, ``jacobian``, ``y0``, for SciPy."""
        given = self._recording(data, run)
        found = self._native.point_by_point(given.argument if given else None, native(run, params, start))
        return Problem(found)

    def rhs(
        self, t: float, y: Any, inputs: Mapping[str, float] | None = None, params: Mapping[str, float] | None = None
    ) -> Array:
        """f of the equations M dy/dt = f(t, y, u, p), in declared units; ``y`` is in the order of ``unknowns``.

        ``inputs`` has a number for each input. For inputs that change over time, use :meth:`problem`.
        """
        equations = self._equations(inputs)
        u, p = _by_name(equations.inputs, inputs, None), self._parameters(equations, params)
        return array(equations.rhs(t, packed(y), u, p))

    def jacobian(
        self, t: float, y: Any, inputs: Mapping[str, float] | None = None, params: Mapping[str, float] | None = None
    ) -> Array:
        """df/dy, a row for each equation."""
        equations = self._equations(inputs)
        u, p = _by_name(equations.inputs, inputs, None), self._parameters(equations, params)
        n = len(equations.unknowns)
        return array(equations.jacobian(t, packed(y), u, p)).reshape(n, n)

    @property
    def unknowns(self) -> dict[str, str]:
        """Names and units of y of :meth:`rhs`, elements of arrays included."""
        return dict(self._equations(dict.fromkeys(self.inputs, 0.0)).unknowns)

    def objective(
        self,
        data: Any,
        *,
        free: Names = (),
        fix: Names = (),
        outputs: Names = (),
        noise: Mapping[str, float] | None = None,
        params: Values = None,
        start: Start = None,
        **run: Unpack[RunOptions],
    ) -> Objective:
        """What a fit makes small, as a function of what it estimates: for SciPy, pyPESTO and samplers.

        ``noise`` has standard deviations of outputs in their units, in place of those that the model declares.
        """
        options = native(run, params, start, free=names(free), fix=names(fix), outputs=names(outputs), noise="declared")
        train, _ = self._recordings(data, None, run)
        sigma = [(name, float(value)) for name, value in (noise or {}).items()]
        return Objective(self._native.objective(_arguments(train), sigma, options))

    # How it goes about that.

    def _declared(self) -> dict[str, str]:
        """Units of all that a recording may have."""
        kinds = ("inputs", "outputs", "states")
        declared = {entry["name"]: entry["unit"] for kind in kinds for entry in self._facts[kind]}
        # An output named like a state is read in its own unit.
        declared.update({entry["name"]: entry["unit"] for entry in self._facts["outputs"]})
        return declared

    def _recording(self, data: Any, run: RunOptions) -> Prepared | None:
        if data is None:
            return None
        return recording(data, run.get("units"), self._known(run), "data")

    def _known(self, run: RunOptions) -> dict[str, str]:
        known = self._declared()
        for column, name in (run.get("rename") or {}).items():
            known.setdefault(column, known.get(name, ""))
        return known

    def _recordings(self, data: Any, valid: Any, run: RunOptions) -> tuple[list[Prepared], list[Prepared]]:
        known, units = self._known(run), run.get("units")
        train, held_out = recordings(data, units, known, "data"), recordings(valid, units, known, "valid")
        if not train:
            raise UsageError("there is no recording")
        apart([train, held_out])
        return train, held_out

    def _equations(self, inputs: Mapping[str, float] | None) -> _dgd.Equations:
        """The equations at constant inputs, which calls replace."""
        if self._plain is None:
            constant = None
            if self.inputs:
                values = {f"{one.name} [{one.unit}]": [(inputs or {}).get(one.name, 0.0)] for one in self.inputs.values()}
                constant = recording({"time [s]": [0.0], **values}, None, {}, "inputs").argument
            self._plain = self._native.point_by_point(constant, native({}, None, None))
        if self.inputs and inputs is None:
            raise UsageError("the model has inputs: `inputs={" + ", ".join(f'"{name}": …' for name in self.inputs) + "}`")
        return self._plain

    def _parameters(self, equations: _dgd.Equations, params: Mapping[str, float] | None) -> bytes | None:
        return _by_name(equations.parameters, params, array(equations.parameter_values)) if params else None

    def _call(self, what: str, given: Prepared | list[Prepared] | None, **options: Any) -> str:
        """The line of Python that makes a result again, for its page."""
        variant, set_before, applied = self._native.choices
        shown = [repr(self.path)]
        if variant:
            shown.append(f"variant={dict(one.split('=', 1) for one in variant)!r}")
        if set_before:
            shown.append(f"params={dict(one.split('=', 1) for one in set_before)!r}")
        if applied:
            shown.append(f"apply={applied!r}")

        def said(value: Any) -> str:
            if isinstance(value, Prepared):
                return repr(value.argument if isinstance(value.argument, str) else value.name)
            if isinstance(value, list) and value and isinstance(value[0], Prepared):
                return "[" + ", ".join(said(one) for one in value) + "]"
            return repr(value)

        arguments = [] if given is None else [said(given)]
        standard = native({}, None, None)
        for name, value in options.items():
            if value not in (None, [], {}, standard.get(name)):
                arguments.append(f"{name}={said(value)}")
        return f"dgd.load({', '.join(shown)}).{what}({', '.join(arguments)})"

    def __reduce__(self) -> tuple[Any, ...]:
        variant, set_before, applied = self._native.choices
        return _restored, (_dgd.__version__, self.path, self._native.texts, variant, set_before, applied)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Model):
            return NotImplemented
        return bool(self.__reduce__()[1] == other.__reduce__()[1])

    def __hash__(self) -> int:
        return hash((self.path, self.text))


def _arguments(prepared: Iterable[Prepared]) -> list[Any]:
    return [one.argument for one in prepared]


def _stopped(why: str, reached: Simulation | Sensitivity) -> SimulationError:
    error = SimulationError(f"{why}; `partial` of this exception has the {len(reached.time)} rows before")
    error.partial = reached
    return error


def _by_name(known: list[tuple[str, str]], asked: Mapping[str, float] | None, standard: Array | None) -> bytes | None:
    """Numbers by name in the order of what is known; of those that are not given the standard."""
    if not known or asked is None:
        return None
    order = [name for name, _ in known]
    for name in asked:
        if name not in order:
            raise UsageError(f"there is no `{name}`; there is `" + "`, `".join(order) + "`")
    missing = [name for name in order if name not in asked]
    if missing and standard is None:
        raise UsageError("there is no value of `" + "`, `".join(missing) + "`")
    values = np.zeros(len(order)) if standard is None else standard.copy()
    for name, value in asked.items():
        values[order.index(name)] = float(value)
    return packed(values)
