"""Fleets whose processes are killed at random moments, and how fast fleets are.

    python kills.py DGD [--dask] [--fits N] [--kills N] [--seed N]

kills, at random moments, what a fleet of short fits consists of: runs and their children, or with --dask the client, the
scheduler, workers, their nannies and their children. In the end there must be the same bytes as undisturbed, no finished piece may
have been computed again, and a rerun must compute nothing. Then the fleet is timed beside `xargs -P2`.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from clusters import Cluster, descendants, is_alive, job, results

#: What two workers have to reach of `xargs -P2`, and the most that a piece may take besides, s.
LEAST_SPEED, MOST_OVERHEAD = 0.9, 0.020

CLIENT = """
import sys, warnings, dgd
warnings.simplefilter("ignore")
fleet = dgd.fleet(sys.argv[1], into=sys.argv[2], cluster=sys.argv[3], patience=60)
fleet.wait()
print(fleet.computed)
"""


class Run:
    """A fleet of `dgd job run`."""

    def __init__(self, dgd: str, path: Path, into: Path) -> None:
        self.line = [dgd, "job", "run", str(path), "--into", str(into), "--workers", "2", "--format", "json"]
        self.begin()

    def begin(self) -> None:
        """Starts it, or goes on."""
        self.process = subprocess.Popen(self.line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def targets(self) -> list[int]:
        """What may be killed."""
        return [self.process.pid, *descendants(self.process.pid)]

    def mend(self) -> None:
        """Starts what was killed."""
        if self.process.poll() not in (None, 0):
            self.begin()

    def is_done(self) -> bool:
        """Whether all have results."""
        return self.process.poll() == 0

    def close(self) -> None:
        """Nothing else was started."""


class Distributed(Run):
    """A fleet on a cluster of Dask."""

    def __init__(self, dgd: str, path: Path, into: Path) -> None:
        self.cluster = Cluster(2)
        self.cluster.mend()
        self.line = [sys.executable, "-c", CLIENT, str(path), str(into), self.cluster.address]
        self.begin()

    def targets(self) -> list[int]:
        scheduler = [self.cluster.scheduler.pid] if self.cluster.scheduler else []
        workers = [one.pid for one in self.cluster.workers]
        below = [child for one in workers for child in descendants(one)]
        return [self.process.pid, *scheduler, *workers, *below]

    def mend(self) -> None:
        self.cluster.mend()
        super().mend()

    def close(self) -> None:
        self.cluster.__exit__()


def inodes(into: Path) -> dict[str, int]:
    """The file of each result: another one of the same name has another number."""
    return {name: (into / name).stat().st_ino for name in results(into)}


def kill_at_random(fleet: Run, into: Path, kills: int, took: float, chance: random.Random) -> dict[str, int]:
    """Kills, and watches that no result is written twice; what was killed, by name."""
    seen: dict[str, int] = {}
    killed: dict[str, int] = {}
    while sum(killed.values()) < kills:
        time.sleep(chance.uniform(0, took / kills))
        fleet.mend()
        if fleet.is_done():
            break
        targets = [one for one in fleet.targets() if is_alive(one)]
        if not targets:
            continue
        target = chance.choice(targets)
        try:
            words = Path(f"/proc/{target}/cmdline").read_bytes().split(b"\0")
            os.kill(target, signal.SIGKILL)
        except OSError:
            continue
        parts = {"child": b"work", "scheduler": b"distributed.cli.dask_scheduler", "worker": b"distributed.cli.dask_worker"}
        name = next((what for what, word in parts.items() if word in words), "run or worker")
        killed[name] = killed.get(name, 0) + 1
        # What is killed starts again at once, so that it is in the middle of something when the next kill comes.
        time.sleep(0.02)
        fleet.mend()
        for path, inode in inodes(into).items():
            assert seen.setdefault(path, inode) == inode, f"{path} was computed again"
    assert sum(killed.values()) == kills, f"the fleet was done after {sum(killed.values())} kills"
    until = time.monotonic() + 300 + 10 * took
    while not fleet.is_done():
        fleet.mend()
        assert time.monotonic() < until, "the fleet does not come to its end"
        time.sleep(0.05)
    after = inodes(into)
    assert all(after[path] == inode for path, inode in seen.items()), "a result was computed again"
    return killed


def timed(line: list[str], **more: object) -> float:
    """How long a command takes."""
    began = time.monotonic()
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL, **more)  # type: ignore[call-overload]
    return time.monotonic() - began


def by_xargs(dgd: str, path: Path, workers: int) -> float:
    """How long the same fits take as commands of their own."""
    data = sorted(path.parent.glob("*.csv"))
    words = "\0".join(str(one) for one in data)
    began = time.monotonic()
    line = ["xargs", "-0", f"-P{workers}", "-n1", dgd, "fit", str(path.parent / "cup.dgd"), "--quiet", "--data"]
    subprocess.run(line, input=words.encode(), check=True, stdout=subprocess.DEVNULL)
    return time.monotonic() - began


def rounds(dgd: str, path: Path, number: int) -> tuple[float, float, float]:
    """How long `xargs -P2`, one worker and two take; the machine may have other work in one of several rounds."""
    line = [dgd, "job", "run", str(path), "--quiet"]
    runs = [timed([*line, "--workers", n, "--into", str(path.parent.parent / f"timed{number}_{n}")]) for n in ("1", "2")]
    return by_xargs(dgd, path, 2), runs[0], runs[1]


def by_dask(path: Path, into: Path) -> float:
    """How long they take on two workers that are there."""
    import dgd

    with Cluster(2) as cluster:
        warm = job(into.parent / f"warm_{into.name}", 2, ["fit"])
        dgd.fleet(warm, into=into.parent / f"warmed_{into.name}", cluster=cluster.address).wait()
        began = time.monotonic()
        dgd.fleet(path, into=into, cluster=cluster.address).wait()
        return time.monotonic() - began


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("dgd")
    parser.add_argument("--dask", action="store_true")
    parser.add_argument("--fits", type=int, default=200)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=28)
    asked = parser.parse_args()
    program = [sys.executable, "-m", "dgd"] if asked.dask else [asked.dgd]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        # Each with some refits, so that the fleet takes seconds and kills come in the middle of pieces.
        path = job(place / "killed", asked.fits, [{"kind": "replicates", "count": 100}])
        run = [*program, "job", "run", str(path), "--quiet", "--workers", "2", "--into"]
        took = timed([*run, str(place / "alone")])
        kind = Distributed if asked.dask else Run
        # What is killed starts again in seconds where Dask does, and is killed on its way there, too.
        fleet = kind(asked.dgd, path, place / "out")
        try:
            span = max(took, 0.5 * asked.kills) if asked.dask else took
            killed = kill_at_random(fleet, place / "out", asked.kills, span, random.Random(asked.seed))
        finally:
            fleet.close()
        assert results(place / "out") == results(place / "alone"), "the bytes are others"
        again = subprocess.run([*run, str(place / "out"), "--format", "json"], check=True, capture_output=True)
        assert json.loads(again.stdout)["computed"] == 0, "a rerun computes something"
        print(f"{asked.fits} fits, killed {killed}: the same bytes, nothing computed again")
        path = job(place / "timed", asked.fits, ["fit"])
        xargs, alone, two = (min(times) for times in zip(*(rounds(asked.dgd, path, k) for k in range(3)), strict=True))
        each = alone / asked.fits
        print(f"a piece takes {1e3 * each:.1f} ms with all that belongs to it; two workers {two:.2f} s, xargs -P2 {xargs:.2f} s")
        assert xargs / two >= LEAST_SPEED, f"two workers reach {xargs / two:.2f} of xargs -P2"
        besides = each - fit_alone(asked.dgd, path)
        print(f"{1e3 * besides:.1f} ms of it are not the fit")
        assert besides <= MOST_OVERHEAD, "a piece takes too much besides"
        if asked.dask:
            dask = min(by_dask(path, place / f"dask{k}") for k in range(3))
            print(f"two workers of Dask take {dask:.2f} s: {1e3 * (2 * dask / asked.fits - each):.1f} ms a piece besides")
            assert 2 * dask / asked.fits - each <= MOST_OVERHEAD, "Dask takes too much besides"
            # Fits of a tenth of a second and more.
            long = job(place / "long", 60, ["fit"], rows=120000)
            # In turns, as the machine may have other work for a while.
            turns = [(by_xargs(asked.dgd, long, 2), by_dask(long, place / f"long{k}")) for k in range(4)]
            xargs, dask = (min(times) for times in zip(*turns, strict=True))
            print(f"60 fits of {2 * xargs / 60:.2f} s: Dask {dask:.2f} s, {xargs / dask:.2f} of the speed of xargs -P2")
            assert xargs / dask >= LEAST_SPEED, "two workers of Dask are too slow"


def fit_alone(dgd: str, path: Path) -> float:
    """How long a fit takes in a process that has started, s: what is left of a command beside one that does nothing."""
    fit = [dgd, "fit", str(path.parent / "cup.dgd"), "--quiet", "--threads", "1", "--data", str(path.parent / "w0.csv")]

    def median(line: list[str]) -> float:
        return sorted(timed(line) for _ in range(21))[10]

    return median(fit) - median([dgd, "--version"])


if __name__ == "__main__":
    main()
