"""Schedulers and workers of Dask as processes of their own on this machine, and jobs for them."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

CUP = """\
model cup
parameter tau [s] = 100 in 1 .. 1e4
state T [K] = 70
equation cooling: tau*der(T) = -T
output T [K] noise 0.1
"""


def job(folder: Path, wells: int, todo: list[object], rows: int = 60) -> Path:
    """Cups that cool, by the closed formula, and a job that does this with each."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cup.dgd").write_text(CUP)
    files = {}
    for k in range(wells):
        time_s = 5.0 * np.arange(rows)
        noise = 0.1 * np.random.default_rng(k).normal(size=rows)
        values = 75 * np.exp(-time_s / (80 + k)) + noise
        text = "time [s],T [K]\n" + "".join(f"{t},{T}\n" for t, T in zip(time_s, values, strict=True))
        (folder / f"w{k}.csv").write_text(text)
        files[f"W-{k}"] = f"w{k}.csv"
    path = folder / "job.json"
    path.write_text(json.dumps({"model": "cup.dgd", "do": todo, "wells": files}))
    return path


def results(into: Path) -> dict[str, bytes]:
    """All results by their paths in the folder; a draft is none."""
    files = (path for state in ("done", "failed") for path in (into / state).rglob("*") if path.is_file())
    return {str(path.relative_to(into)): path.read_bytes() for path in files if not path.name.startswith(".")}


def run(*words: str) -> subprocess.CompletedProcess[str]:
    """The command."""
    line = [sys.executable, "-m", "dgd", *words]
    return subprocess.run(line, capture_output=True, text=True, check=False)


def descendants(of: int) -> list[int]:
    """All processes below one."""
    found = []
    for task in Path(f"/proc/{of}/task").glob("*"):
        try:
            children = [int(word) for word in (task / "children").read_text().split()]
        except OSError:
            continue
        for child in children:
            found += [child, *descendants(child)]
    return found


def is_alive(process: int) -> bool:
    """Whether a process is there, and not only for its parent to wait for."""
    try:
        return ") Z " not in Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False


class Cluster:
    """A scheduler and workers, each of which may be killed."""

    def __init__(self, workers: int, *options: str, nthreads: int = 1) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.options = ["--nthreads", str(nthreads), *options]
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []
        self.count = workers

    def _start(self, module: str, *words: str) -> subprocess.Popen[bytes]:
        line = [sys.executable, "-m", f"distributed.cli.{module}", *words]
        environment = {**os.environ, "PYTHONWARNINGS": "ignore"}
        return subprocess.Popen(
            line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
        )

    def start_scheduler(self) -> None:
        """Starts a scheduler, at the port where one was before."""
        self.scheduler = self._start(
            "dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard"
        )

    def start_worker(self) -> None:
        """Starts a worker, and the nanny that starts it again."""
        words = [self.address, "--no-dashboard", "--local-directory", "/tmp", *self.options]
        self.workers.append(self._start("dask_worker", *words))

    def mend(self) -> None:
        """Starts what has ended."""
        if self.scheduler is None or self.scheduler.poll() is not None:
            self.start_scheduler()
        self.workers = [one for one in self.workers if one.poll() is None]
        while len(self.workers) < self.count:
            self.start_worker()

    def __enter__(self) -> Cluster:
        self.mend()
        return self

    def __exit__(self, *_: object) -> None:
        processes = [*self.workers, *([self.scheduler] if self.scheduler else [])]
        below = [child for one in processes for child in descendants(one.pid)]
        for one in processes:
            one.kill()
            one.wait()
        for child in below:
            try:
                os.kill(child, signal.SIGKILL)
            except ProcessLookupError:
                pass


def wait_for(what: object, seconds: float = 30) -> None:
    """Waits until something holds."""
    until = time.monotonic() + seconds
    while not what():  # type: ignore[operator]
        assert time.monotonic() < until, "it does not come to that"
        time.sleep(0.02)
