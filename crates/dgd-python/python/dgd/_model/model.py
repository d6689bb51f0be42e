"""Models: loading, and their methods."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from .. import _dgd
from .._errors import DgdWarning, SimulationError, warn
from .._options import Names, Start, Values, choices, names, native, settings
from .._results.discovery import Discovery
from .._results.fit import Fit
from .._results.series import Sensitivity, Simulation
from .._show.progress import Progress, Shown
from .._track import Tracker
from .asked import arguments
from .pointwise import Pointwise

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._options import RunOptions

OfRun = TypeVar("OfRun", Simulation, Sensitivity)


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

    Raises :class:`ModelError` with the errors, and `OSError` if there is no such file.
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
    """Like :func:`load`, for a text. ``name`` names it in errors, and is the path that imports and effects are relative to."""
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
    """Restores a model from a pickle."""
    if version != _dgd.__version__:
        words = f"the model was pickled by dgd {version} and is compiled by {_dgd.__version__}: numbers may differ"
        warnings.warn(words, DgdWarning, stacklevel=2)
    return Model(_dgd.load(path, texts, variant, set, apply))


class Model(Pointwise):
    """A model: its declarations and methods. It is immutable, and any thread may use it.

    ``load`` and ``parse`` create models. A pickle contains the texts, the options and the version of dgd.
    """

    def changed(
        self,
        *,
        variant: Mapping[str, str] | None = None,
        params: Values = None,
        apply: str | Sequence[str] | None = None,
    ) -> Model:
        """The same texts with these variants and values in addition to the present ones, and with these effects."""
        chosen, set_before, applied = self._native.choices
        kept = [one for one in chosen if one.split("=")[0] not in (variant or {})]
        left = [one for one in set_before if one.split("=")[0] not in (params or {})]
        effects = applied if apply is None else _effects(apply)
        return _loaded(self.path, self._native.texts, kept + choices(variant), left + settings(params), effects)

    def _with_text(self, text: str, is_whole: bool) -> Model:
        """The model with another text, which includes effects and settings."""
        variant, set_before, _ = self._native.choices
        kept = {path: content for path, content in self._native.texts}
        kept[self.path] = text.encode()
        return Model(_dgd.load(self.path, list(kept.items()), variant, [] if is_whole else set_before, []))

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
        needs no data, but ``until``.

        ``params`` sets parameters, constants and sizes, ``start`` initial values, both in declared units;
        ``start="measured"`` takes them from the first measurements, ``"steady"`` begins at the steady state. ``every``
        is the time between rows, s. ``noise_seed`` adds noise of the declared size to the outputs. The other options are
        those of :class:`dgd._options.RunOptions`: units, rename, from_, until, method, steps, rtol, atol, engine, seed,
        threads.

        Raises :class:`SimulationError`, whose ``partial`` has the results so far, :class:`DataError` and
        :class:`UsageError`.
        """
        ran = self._ran(self._native.simulate, data, run, params, start, every=every, noise_seed=noise_seed)
        return _whole(Simulation(*ran), ran[0])

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
        """Derivatives of states and outputs ``of`` to parameters, or initial values of states, ``to``, over time.

        The defaults are all states and outputs, and all parameters. ``scaled`` multiplies each derivative by its
        parameter. The other options are those of :meth:`simulate`.
        """
        wanted: dict[str, Any] = dict(of=names(of), to=names(to), scaled=scaled, every=every)
        ran = self._ran(self._native.sensitivity, data, run, params, start, **wanted)
        return _whole(Sensitivity(*ran, scaled), ran[0])

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
        spread: str = "values",
        noise: str = "estimated",
        loss: str = "squares",
        estimator: str = "output-error",
        profile: Names = (),
        bootstrap: int = 0,
        information: bool = False,
        evaluations: int | None = None,
        smoothing: float | None = None,
        steady: Mapping[str, float] | None = None,
        at: float | str | None = None,
        filter: float | Sequence[float] | None = None,
        forgetting: float = 0.0,
        start_variance: float = 10.0,
        most_variance: float | None = None,
        normalise: str = "none",
        start_point: int | None = None,
        bootstrap_from: int | None = None,
        progress: Progress = None,
        **run: Unpack[RunOptions],
    ) -> Fit:
        """Estimates parameters and initial values from recordings, and tests them on others.

        ``data`` and ``valid`` are lists of recordings, dictionaries of them by name, or single recordings as in
        :meth:`simulate`. ``free`` and ``fix`` name parameters to estimate, or not; ``outputs`` names the outputs to
        compare. ``params`` and ``start`` are initial guesses. ``starts`` is the number of starting points, of which the
        best fit is kept; ``spread`` draws them around the ``"values"`` or from the range between the ``"bounds"``.
        ``noise``, ``loss`` and ``estimator`` are names as in ``dgd fit --help``. ``profile`` names estimates whose
        intervals are computed by profile likelihood, ``bootstrap`` is the number of refits to resampled residuals.
        ``start_point`` and ``bootstrap_from`` compute a share of several starts or refits.

        ``at`` is the operating point of ``estimator="linearised"``: a time in s, ``"steady"`` or ``"mean"``. Regressions
        take slopes over windows of half width ``smoothing``, s, and with ``steady`` only samples at which a state changes
        no faster. ``filter`` (time constants in s), ``forgetting``, ``start_variance``, ``most_variance`` and
        ``normalise`` configure ``estimator="recursive"``.

        ``progress`` is ``True``, ``False``, or a function that is called with the unit of work, the number done, the
        total, and whether that is only an upper limit.

        Ctrl-C ends the fit with the best result so far. A fit that did not converge is a result with
        ``converged == False`` and a warning. Raises :class:`FitError` only if the model cannot be
        evaluated at any point.
        """
        slow = [f"{name}={value!r}" for name, value in (steady or {}).items()]
        calls: dict[str, Any] = dict(
            free=names(free),
            fix=names(fix),
            outputs=names(outputs),
            starts=starts,
            spread=spread,
            noise=noise,
            loss=loss,
            estimator=estimator,
            profile=names(profile),
            bootstrap=bootstrap,
            information=information,
            evaluations=evaluations,
            smoothing=smoothing,
            steady=slow,
            at=at,
            filter=filter,
            forgetting=forgetting,
            start_variance=start_variance,
            most_variance=most_variance,
            normalise=normalise,
            start_point=start_point,
            bootstrap_from=bootstrap_from,
        )
        options = native(run, params, start, **calls)
        train, held_out = self._recordings(data, valid, run)
        options["command"] = self._line("fit", train, valid=held_out or None, params=params, start=start, **calls, **run)
        with Shown(progress) as shown:
            found = self._native.fit(arguments(train), arguments(held_out), options, shown.call)

        def profiled(model: Model, wanted: list[str]) -> Fit:
            plain = dict.fromkeys(("starts", "start_point", "spread", "bootstrap", "bootstrap_from"))
            more = {**options, **plain, "set": [], "profile": wanted}
            again = model._native.fit(arguments(train), arguments(held_out), more, None)
            return model._fit(again, profiled)

        fitted = self._fit(found, profiled)
        warn([*found.remarks, *found.reservations])
        return fitted

    def _fit(self, found: _dgd.Found, profiled: Callable[[Model, list[str]], Fit]) -> Fit:
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
        """Finds where the model and the recordings disagree, and which known effect is missing.

        ``data`` and ``valid`` are as for :meth:`fit`. ``effects`` lists folders of effects in addition to the one beside
        the model. ``budget`` is a time limit, s. Ctrl-C ends the search with the best result so far.
        """
        folders = [effects] if isinstance(effects, str) else [os.fspath(folder) for folder in effects]
        calls = dict(effects=folders, free=names(free), fix=names(fix), budget=budget)
        options = native(run, params, start, **calls)
        train, held_out = self._recordings(data, valid, run)
        options["command"] = self._line(
            "discover", train, valid=held_out or None, params=params, start=start, **calls, **run
        )
        with Shown(progress) as shown:
            found = self._native.discover(arguments(train), arguments(held_out), options, shown.call)
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
        """Online estimation of states and parameters: ``t = m.track(); t.update(row)`` for each row as it arrives.

        ``estimator`` is ``"ekf"``, ``"ukf"`` or ``"recursive"``. ``process_noise`` has standard deviations of random
        walks after one minute, ``start_std`` initial ones, ``noise`` those of outputs, each by name and in declared
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
        return Tracker(self._native.track(options), run.get("units"), self._units())

    def __reduce__(self) -> tuple[Any, ...]:
        variant, set_before, applied = self._native.choices
        return _restored, (_dgd.__version__, self.path, self._native.texts, variant, set_before, applied)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Model):
            return NotImplemented
        return bool(self.__reduce__()[1] == other.__reduce__()[1])

    def __hash__(self) -> int:
        return hash((self.path, self.text))


def _whole(result: OfRun, found: _dgd.Run) -> OfRun:
    """The result of a complete run; raises for a run that stopped early."""
    # Of the call two levels up.
    warn(found.remarks, stacklevel=3)
    if found.stopped is None:
        return result
    error = SimulationError(f"{found.stopped}; `partial` of this exception has the {len(result.time)} rows before")
    error.partial = result
    raise error
