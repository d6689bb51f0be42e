"""What the Python package costs: its size, its calls beside those of Rust, and threads. Fails where a bar is missed.

python tests/measure.py WHEEL RUST_CALL

WHEEL is the wheel, RUST_CALL the program of crates/dgd-work/examples/rust_call.rs.
"""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from conftest import DATA, MODEL, columns

import dgd

MOST_MEGABYTES = 8.0
MOST_OF_RUST = 1.2
LEAST_OF_TWO_THREADS = 1.5


def least(call: Callable[[], object], calls: int = 60) -> float:
    """The least time that a call takes, ms."""
    times = []
    for _ in range(calls):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)


def speedup(call: Callable[[], object], calls: int = 200) -> float:
    """How much faster two threads are than one."""

    def many(n: int) -> None:
        for _ in range(n):
            call()

    begin = time.perf_counter()
    many(calls)
    alone = time.perf_counter() - begin
    threads = [threading.Thread(target=many, args=(calls // 2,)) for _ in range(2)]
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return alone / (time.perf_counter() - begin)


def main(wheel: Path, rust_call: str) -> int:
    data = DATA / "circulation.csv"
    model, arrays = dgd.load(MODEL), columns(data)
    calls: dict[str, Callable[[], object]] = {
        "file": lambda: model.simulate(str(data)),
        "columns": lambda: model.simulate(arrays),
    }
    missed = []
    size = wheel.stat().st_size / 1e6
    print(f"wheel {size:.2f} MB (at most {MOST_MEGABYTES})")
    if size > MOST_MEGABYTES:
        missed.append("size")
    # In turns, so that both see the machine in the same state.
    rust: dict[str, float] = {}
    python: dict[str, float] = {}
    for _ in range(3):
        printed = subprocess.run([rust_call, MODEL, str(data)], capture_output=True, text=True, check=True).stdout
        for name, milliseconds in (line.split() for line in printed.splitlines()):
            rust[name] = min(rust.get(name, float("inf")), float(milliseconds))
            python[name] = min(python.get(name, float("inf")), least(calls[name]))
    for name, call in rust.items():
        print(f"simulate, {name}: {python[name]:.2f} ms, in Rust {call:.2f} ms, {python[name] / call:.2f} times")
        if python[name] > MOST_OF_RUST * call:
            missed.append(f"simulate, {name}")
    # Other work on the machine can only hide it.
    faster = max(speedup(calls["columns"]) for _ in range(3))
    print(f"two threads: {faster:.2f} times as fast as one (at least {LEAST_OF_TWO_THREADS})")
    if faster < LEAST_OF_TWO_THREADS:
        missed.append("threads")
    print(f"missed: {', '.join(missed) or 'none'}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2]))
