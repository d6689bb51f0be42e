"""Pieces of a job on a Dask cluster."""

from __future__ import annotations

import json
import os
import queue
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._errors import DgdError, UsageError, warn
from . import worker as on_worker
from .listing import Listed, Listing, Piece, said

if TYPE_CHECKING:
    from distributed import Client, Future

#: How often it is looked which workers there are, s.
_LOOKS = 0.5
#: Pieces that wait at the scheduler for each that is computed: so many that no worker waits for the next.
_AHEAD = 4
#: A piece that takes so many workers with it is given up.
_MOST_KILLED = 3
#: Workers that are asked at once whether they compute pieces.
_ASKED_AT_ONCE = 16


def fleet(
    jobs: str | os.PathLike[str],
    into: str | os.PathLike[str],
    cluster: Any = None,
    *,
    threads: int | None = None,
    memory: str | None = None,
    retry: bool = False,
    patience: float = 300.0,
) -> Fleet:
    """Computes the pieces of a job file that have no result, on a Dask cluster.

    >>> for piece in dgd.fleet("fleet.json", into="results", cluster="tcp://head:8786"):
    ...     print(piece.well, piece.what, piece.state)

    The iterator yields all pieces, first those that already had a result, then the others as they finish. Workers must
    find the job file, its files and `into` under the same paths. The folder `into` is the record of progress: repeat an
    interrupted call to continue it, on this cluster, on another one, or with `dgd job run`.

    ========== =========================================================================================
    jobs       the job file, as ``dgd job run`` takes it
    into       the folder of the results
    cluster    a Dask client or cluster, or the address of a scheduler; default: this machine
    threads    threads per piece; default: that of the job file
    memory     memory limit per piece, such as ``"2 GB"``; default: that of the job file
    retry      also compute failed pieces again
    patience   how long to wait for a scheduler that disappeared, s
    ========== =========================================================================================

    Workers with another build or type of machine, and those without room for a piece, are refused with a warning. If all
    are refused, this raises a :class:`DgdError`.
    """
    return Fleet(jobs, into, cluster, threads=threads, memory=memory, retry=retry, patience=patience)


class Fleet:
    """The pieces of a job, computed by :func:`fleet`: iterate over them, or :meth:`wait` for all."""

    def __init__(
        self,
        jobs: str | os.PathLike[str],
        into: str | os.PathLike[str],
        cluster: Any,
        *,
        threads: int | None,
        memory: str | None,
        retry: bool,
        patience: float,
    ) -> None:
        if os.fspath(into).startswith("s3://"):
            raise UsageError(
                f"into={os.fspath(into)!r}: results of a cluster lie in a folder that all workers see; "
                "for buckets `tools/s3/` of the sources builds a command"
            )
        self._job, self._into = Path(jobs).absolute(), Path(into).absolute()
        self._into.mkdir(parents=True, exist_ok=True)
        # Links are followed once, as the command does.
        self._into = self._into.resolve()
        self._cluster, self._retry, self._patience = cluster, retry, patience
        self._listing = Listing.of(self._job, self._into, threads)
        self._memory = self._listing.memory if memory is None else _bytes(memory)
        self._pieces = self._run()
        #: Workers that were refused, and why.
        self.refused: dict[str, str] = {}
        #: How many pieces this call has had computed.
        self.computed = 0

    def __len__(self) -> int:
        return len(self._listing.pieces)

    def __iter__(self) -> Iterator[Piece]:
        return self

    def __next__(self) -> Piece:
        return next(self._pieces)

    def wait(self) -> list[Piece]:
        """All pieces, once all have a result, in the order of the job."""
        return sorted(self, key=lambda piece: piece.index)

    def summary(self) -> dict[str, Any]:
        """The report so far, as ``dgd job report --format json``."""
        found: dict[str, Any] = json.loads(
            said(["job", "report", str(self._job), "--into", str(self._into), "--format", "json"])
        )
        return found

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes tables and pages over all wells, as ``dgd job report -o``."""
        said(["job", "report", str(self._job), "--into", str(self._into), "-o", os.fspath(folder), "--quiet"])

    def __repr__(self) -> str:
        return f"<dgd.Fleet: {len(self)} pieces into {self._into}>"

    def _run(self) -> Iterator[Piece]:
        todo: deque[Listed] = deque()
        for one in self._listing.pieces:
            found = one.found()
            if found is None or (self._retry and found.state == "failed"):
                todo.append(one)
            else:
                yield found
        if todo:
            connection = _Connection(self._cluster, self._patience)
            distribution = _Distribution(self, connection, todo)
            try:
                yield from distribution.run()
            finally:
                distribution.close()
                connection.close()


class _Connection:
    """A client that reconnects after its scheduler disappeared."""

    def __init__(self, cluster: Any, patience: float) -> None:
        try:
            import distributed
        except ImportError:
            raise DgdError("a fleet needs Dask: pip install distributed") from None
        self._dask, self._patience = distributed, patience
        self._owned: list[Any] = []
        if cluster is None:
            # Pieces are computed in processes of their own.
            cores = os.cpu_count() or 1
            cluster = distributed.LocalCluster(
                n_workers=1, threads_per_worker=cores, processes=False, dashboard_address=None
            )
            self._owned.append(cluster)
        if isinstance(cluster, distributed.Client):
            self.client: Client = cluster
            self._address = cluster.scheduler.address
        else:
            self._address = cluster if isinstance(cluster, str) else cluster.scheduler_address
            self.client = self._connected()

    def _connected(self) -> Client:
        until = time.monotonic() + self._patience
        while True:
            try:
                client = self._dask.Client(self._address, timeout=5, set_as_default=False)
                self._owned.append(client)
                return client
            except (OSError, TimeoutError) as error:
                if time.monotonic() > until:
                    raise DgdError(
                        f"there has been no scheduler at {self._address} for {self._patience:.0f} s: {error}; the "
                        "same call goes on once there is one"
                    ) from None
                time.sleep(_LOOKS)

    def again(self) -> None:
        """Connects to the scheduler that replaced the previous one."""
        if self.client in self._owned:
            self._owned.remove(self.client)
            # What it says of a scheduler that is away is known.
            with suppress(Exception):
                self.client.close(timeout=1)
        self.client = self._connected()

    def close(self) -> None:
        """Closes connections that were opened here."""
        while self._owned:
            with suppress(TimeoutError):
                self._owned.pop().close()


class _Distribution:
    """Submitted pieces and their results."""

    def __init__(self, fleet: Fleet, connection: _Connection, todo: deque[Listed]) -> None:
        self._fleet, self._connection, self._todo = fleet, connection, todo
        listing = fleet._listing
        self._with: tuple[Any, ...] = (listing.identity, listing.threads, fleet._memory)
        #: Workers that compute pieces, each with its threads.
        self._workers: dict[str, int] = {}
        self._under_way: dict[Future, tuple[Listed, list[str]]] = {}
        self._ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._killed: dict[str, int] = {}
        self._looked = -_LOOKS
        #: Workers that are being asked, by threads: one that ends meanwhile takes long to be missed.
        self._asking: dict[str, Any] = {}
        self._asker = ThreadPoolExecutor(_ASKED_AT_ONCE)

    def close(self) -> None:
        """Stops polling workers."""
        self._asker.shutdown(wait=False, cancel_futures=True)

    def run(self) -> Iterator[Piece]:
        """Yields pieces as they finish."""
        while self._todo or self._under_way:
            try:
                self._look()
                self._submit()
            except (OSError, TimeoutError, RuntimeError) as error:
                # The scheduler is away: what it knew is asked of the store.
                if not self._is_away():
                    raise DgdError(str(error)) from error
                yield from self._begin_again()
                continue
            try:
                future = self._ended.get(timeout=_LOOKS)
            except queue.Empty:
                continue
            entry = self._under_way.pop(future, None)
            if entry is not None:
                found = self._taken(future, entry[0])
                if found is not None:
                    self._fleet.computed += 1
                    yield found
            if self._is_away():
                yield from self._begin_again()

    def _is_away(self) -> bool:
        return bool(self._connection.client.status != "running")

    def _begin_again(self) -> Iterator[Piece]:
        """Continues with another connection; pieces finished in the meantime have results."""
        lost = [listed for listed, _ in self._under_way.values()]
        self._under_way.clear()
        self._workers.clear()
        self._asking.clear()
        self._ended = queue.SimpleQueue()
        self._connection.again()
        self._looked = -_LOOKS
        for listed in lost:
            found = listed.found()
            # One that failed before and is to be done again still has that result.
            if found is None or (self._fleet._retry and found.state == "failed"):
                self._todo.append(listed)
            else:
                self._fleet.computed += 1
                yield found

    def _look(self) -> None:
        """Checks whether new workers compute pieces, and drops those that left."""
        if time.monotonic() < self._looked + _LOOKS:
            return
        client, refused = self._connection.client, self._fleet.refused
        there: dict[str, int] = client.nthreads()
        for address in [one for one in self._workers if one not in there]:
            del self._workers[address]
        for address in there:
            if address not in self._workers and address not in refused and address not in self._asking:
                self._asking[address] = self._asker.submit(
                    client.run, on_worker.probe, *self._with, workers=[address], on_error="return"
                )
        for address, asked in list(self._asking.items()):
            if not asked.done():
                continue
            del self._asking[address]
            # One that has ended, or could not answer, is asked again while it is there.
            answer = None if asked.exception() else asked.result().get(address, "")
            if asked.exception() is None and answer is None and address in there:
                self._workers[address] = there[address]
            elif isinstance(answer, str) and answer:
                refused[address] = answer
                warn([f"the worker {address} {answer}"], stacklevel=4)
        if there and not self._workers and all(one in refused for one in there):
            reasons = "; ".join(f"{one} {why}" for one, why in refused.items() if one in there)
            raise UsageError(f"no worker computes pieces: {reasons}")
        self._release()
        self._looked = time.monotonic()

    def _release(self) -> None:
        """Withdraws pieces that wait for workers, if all of these left."""
        for future, (listed, workers) in list(self._under_way.items()):
            if not any(one in self._workers for one in workers) and not future.done():
                del self._under_way[future]
                future.cancel()
                self._todo.append(listed)

    def _submit(self) -> None:
        """Submits enough pieces to keep all workers busy."""
        workers = list(self._workers)
        most = _AHEAD * sum(self._workers.values())
        while self._todo and len(self._under_way) < most:
            listed = self._todo.popleft()
            task = {**listed.task, "memory": self._fleet._memory}
            future = self._connection.client.submit(
                on_worker.perform, task, *self._with, workers=workers, pure=False, key=f"dgd-{listed.name}-{time.monotonic_ns()}"
            )
            self._under_way[future] = (listed, workers)
            future.add_done_callback(self._ended.put)

    def _taken(self, future: Future, listed: Listed) -> Piece | None:
        """The outcome of a piece; None if it must be repeated."""
        if future.status == "finished":
            state, reason = future.result()
            future.release()
            if state != "refused":
                return listed.found()
            # A worker of another build, which came in the place of one that was asked.
            self._looked = -_LOOKS
            self._todo.append(listed)
            return None
        found = listed.found()
        if found is not None and not (self._fleet._retry and found.state == "failed"):
            return found
        if future.status == "error":
            error = future.exception()
            if type(error).__name__ != "KilledWorker":
                raise DgdError(f"{listed.what} of {listed.task['piece']['well']}: {error}")
            self._killed[listed.name] = self._killed.get(listed.name, 0) + 1
            if self._killed[listed.name] >= _MOST_KILLED:
                return self._given_up(listed)
        self._todo.append(listed)
        return None

    def _given_up(self, listed: Listed) -> Piece | None:
        """Records a piece that crashes workers as failed."""
        reason = "its worker was ended each time that it was tried, as systems do that run out of memory"
        child = on_worker.Child()
        child.ask({"perform": {**listed.task, "given_up": reason}})
        child.ended()
        return listed.found()


def _bytes(text: str) -> int:
    """Formats a size for people."""
    units = {"B": 1, "kB": 1e3, "KB": 1e3, "MB": 1e6, "GB": 1e9, "KiB": 1024, "MiB": 1024**2, "GiB": 1024**3}
    digits = text.rstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz ")
    unit = units.get(text[len(digits) :].strip())
    try:
        size = float(digits) * unit if unit is not None else 0.0
    except ValueError:
        size = 0.0
    if size < 1:
        raise UsageError(f'`memory="{text}"` is a size, such as "2 GB"')
    return int(size)


def _by_value() -> None:
    """Sends workers the code of `worker.py` by value, so they need no copy."""
    import cloudpickle

    cloudpickle.register_pickle_by_value(on_worker)


try:
    _by_value()
except ImportError:
    # Without Dask there are no workers.
    pass
