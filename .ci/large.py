"""A recording of many rows, simulated, written and fitted in bounded memory.

    python large.py DGD ROWS [--memory SIZE] [--also]

Fails where a process holds more than SIZE at any moment, or the estimates are not those that the recording was made with.
With --also it is done once more without a bound: the bytes must be the same.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

# Those of the test that is a slice of this.
MODELS = Path(__file__).parent.parent / "crates" / "dgd-cli" / "tests" / "models"


def watched(name: str, line: list[str]) -> tuple[str, int]:
    """Runs a command; what it prints, and how many bytes it held at most."""
    began = time.monotonic()
    with tempfile.TemporaryFile() as out:
        child = subprocess.Popen(line, stdout=out)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        assert child.returncode == 0, f"{line} ended with {child.returncode}"
        out.seek(0)
        text = out.read().decode()
    took = time.monotonic() - began
    most = 1024 * usage.ru_maxrss
    print(f"{name}: {took:.0f} s, {usage.ru_utime + usage.ru_stime:.0f} s of processor time, held {most / 1e6:.0f} MB at most")
    return text, most


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("dgd")
    parser.add_argument("rows", type=int)
    parser.add_argument("--memory", type=int, default=500, help="MB")
    parser.add_argument("--also", action="store_true")
    asked = parser.parse_args()
    place = os.environ.get("TMPDIR") or ("/var/tmp" if Path("/var/tmp").is_dir() else None)
    with tempfile.TemporaryDirectory(dir=place) as folder:
        at = Path(folder)
        bound = ["--memory", f"{asked.memory}MB", "--scratch", folder]

        def simulation(name: str) -> list[str]:
            run = [asked.dgd, "simulate", str(MODELS / "heater.dgd"), "--until", str(asked.rows - 1), "--every", "1"]
            return [*run, "--noise-seed", "3", "-o", str(at / name)]

        fit = [asked.dgd, "fit", str(MODELS / "heated.dgd"), "--data", str(at / "run.parquet"), "--format", "json", "--quiet"]
        _, simulated = watched("simulated and written", [*simulation("run.parquet"), *bound])
        size = (at / "run.parquet").stat().st_size
        print(f"{asked.rows} rows are {size / 1e6:.0f} MB of Parquet")
        text, fitted = watched("read and fitted", [*fit, *bound])
        result = json.loads(text)
        for most in (simulated, fitted):
            assert most <= 1e6 * asked.memory, f"{most / 1e6:.0f} MB were held"
        for name, true in (("tau", 400.0), ("gain", 0.5)):
            found = result["parameters"][name]
            off = abs(found["value"] - true) / found["std"]
            print(f"{name} = {found['value']:.7g}, off by {off:.1f} standard deviations")
            assert off < 5, f"{name} is {found['value']} ± {found['std']}"
        if asked.also:
            watched("simulated without a bound", simulation("again.parquet"))
            same = subprocess.run(["cmp", str(at / "run.parquet"), str(at / "again.parquet")], check=False).returncode == 0
            assert same, "the simulation's bytes are others without a bound"
            other, _ = watched("fitted without a bound", fit)
            assert text == other, "the fit's bytes are others without a bound"
            print("the same bytes without a bound")


if __name__ == "__main__":
    main()
