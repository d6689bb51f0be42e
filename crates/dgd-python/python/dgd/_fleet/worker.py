"""Code that runs in a Dask worker: child processes that compute pieces, as many at a time as the worker has room for.

It goes to workers by value: they need the command of dgd, and no Python of it. A child ends with its worker, as its
standard input does.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from typing import Any

#: A piece whose child is ended so often is given up, as `dgd job run` does.
ATTEMPTS = 3


class Child:
    """A process that computes pieces."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "dgd", "job", "work"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            encoding="utf-8",
        )

    def ask(self, question: Any) -> Any:
        """Its answer; None if it ended instead."""
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            self.process.stdin.write(json.dumps(question) + "\n")
            self.process.stdin.flush()
            answer = self.process.stdout.readline()
        except OSError:
            return None
        return json.loads(answer) if answer.endswith("\n") else None

    def ended(self) -> str:
        """How it ended."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.close()
        except OSError:
            pass
        code = self.process.wait()
        if code == -9:
            return "was killed, as systems do that run out of memory"
        return f"was ended by signal {-code}" if code < 0 else f"ended with code {code}"


class Room:
    """The children of a worker, and how many may compute at a time."""

    def __init__(self, identity: dict[str, str], slots: int) -> None:
        self.identity = identity
        self.free = threading.Semaphore(slots)
        self.idle: list[Child] = []
        self.lock = threading.Lock()

    def child(self) -> Child:
        with self.lock:
            if self.idle:
                return self.idle.pop()
        return Child()

    def keep(self, child: Child) -> None:
        with self.lock:
            self.idle.append(child)

    def perform(self, task: dict[str, Any]) -> str:
        """The outcome of a piece: `done` or `failed`."""
        with self.free:
            how = ""
            for attempt in range(ATTEMPTS + 1):
                if attempt == ATTEMPTS:
                    reason = f"each of {ATTEMPTS} times that it was tried, the process that computed it {how}"
                    task = {**task, "given_up": reason}
                child = self.child()
                answer = child.ask({"perform": task})
                if answer is None:
                    how = child.ended()
                    continue
                self.keep(child)
                if "refused" in answer:
                    raise RuntimeError(answer["refused"])
                return str(next(iter(answer)))
            raise RuntimeError(f"the process that was to write a result {how}")


def refusal(worker: Any, identity: dict[str, str], threads: int, memory: int | None) -> str | None:
    """The reason why a worker cannot compute pieces; None if it can, and has room for them."""
    try:
        child = Child()
        answer = child.ask("identity")
    except OSError as error:
        return f"has no program that computes pieces: {error}"
    if not isinstance(answer, dict) or "identity" not in answer:
        child.ended()
        return f"has no dgd that computes pieces: `{sys.executable} -m dgd job work` does not answer"
    found = answer["identity"]
    different = difference(found, identity)
    if different is not None:
        child.ended()
        return f"has {different}; results have the same bytes for one build on one type of machine only"
    nthreads = worker.state.nthreads
    slots = nthreads // threads
    if slots == 0:
        child.ended()
        return f"has {nthreads} threads, and a piece takes {threads}"
    limit = worker.memory_manager.memory_limit
    if memory is not None and limit:
        if limit < memory:
            child.ended()
            return f"may take {limit / 1e9:.1f} GB of memory, and a piece {memory / 1e9:.1f} GB"
        slots = min(slots, limit // memory)
    room = Room(found, slots)
    room.keep(child)
    worker.dgd_room = room
    return None


def difference(found: dict[str, str], wanted: dict[str, str]) -> str | None:
    """The difference between builds; None if they agree."""
    if found["version"] != wanted["version"]:
        return f"dgd {found['version']}, not {wanted['version']}"
    if found["platform"] != wanted["platform"]:
        return f"dgd for {found['platform']}, not for {wanted['platform']}"
    if found["build"] != wanted["build"]:
        return f"another build of dgd {found['version']}, {found['build'][-8:]} and not {wanted['build'][-8:]}"
    if found["arithmetic"] != wanted["arithmetic"]:
        return "a processor or a library whose `exp`, `log` or `sin` differ in their last digits"
    return None


def perform(task: dict[str, Any], identity: dict[str, str], threads: int, memory: int | None) -> tuple[str, str]:
    """Computes a piece in a worker: its outcome, or `refused` with the reason."""
    from distributed import get_worker

    worker: Any = get_worker()
    with _lock_of(worker):
        room = getattr(worker, "dgd_room", None)
        if room is None or room.identity != identity:
            reason = refusal(worker, identity, threads, memory)
            if reason is not None:
                return "refused", reason
            room = worker.dgd_room
    return room.perform(task), ""


def probe(identity: dict[str, str], threads: int, memory: int | None, dask_worker: Any = None) -> str | None:
    """None if a worker computes pieces, else the reason why it does not."""
    with _lock_of(dask_worker):
        return refusal(dask_worker, identity, threads, memory)


def _lock_of(worker: Any) -> Any:
    """A lock shared by all tasks of a worker."""
    return worker.__dict__.setdefault("dgd_lock", threading.Lock())
