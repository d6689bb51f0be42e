"""Results of jobs in a bucket, by a server of this machine that answers as S3 does (moto).

    python check.py DGD

The results in a bucket are those in a folder to the byte, of several runs at once one puts each result, whatever is killed no
finished piece is computed again, and what the server does not answer is never taken for an answer.
"""

from __future__ import annotations

import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
import xml.etree.ElementTree as ET
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "crates" / "dgd-python" / "tests"))

from clusters import is_alive, job, results

#: Fits, and runs that are killed on their way.
FITS, KILLS = 60, 8


class Server:
    """moto, at a port of this machine."""

    def __init__(self) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.address = f"http://127.0.0.1:{port}"
        line = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
        self.process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith("AWS_")},
            "AWS_ACCESS_KEY_ID": "test",
            "AWS_SECRET_ACCESS_KEY": "test",
            "AWS_REGION": "us-east-1",
            "AWS_ENDPOINT": self.address,
            "AWS_ALLOW_HTTP": "true",
        }
        until = time.monotonic() + 60
        while True:
            try:
                self.ask("GET", "/")
                break
            except OSError:
                assert time.monotonic() < until, "moto does not start"
                time.sleep(0.1)

    def ask(self, method: str, path: str, body: bytes | None = None) -> bytes:
        """A request with a signature that is none: moto does not look at it."""
        asks = "AWS4-HMAC-SHA256 Credential=test/20260101/us-east-1/s3/aws4_request, SignedHeaders=host, Signature=0"
        headers = {"Authorization": asks, "Content-Type": "application/xml"}
        request = urllib.request.Request(self.address + path, data=body, method=method, headers=headers)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return bytes(answer.read())

    def bucket(self, name: str) -> None:
        """Makes a bucket that keeps all that was ever put."""
        self.ask("PUT", f"/{name}")
        kept = b"<VersioningConfiguration><Status>Enabled</Status></VersioningConfiguration>"
        self.ask("PUT", f"/{name}?versioning", kept)

    def versions(self, name: str, folder: str) -> dict[str, int]:
        """How often each key was put."""
        found: dict[str, int] = {}
        more = ""
        while True:
            answer = ET.fromstring(self.ask("GET", f"/{name}?versions&prefix={folder}/{more}"))
            space = answer.tag.partition("}")[0] + "}"
            for one in answer.iter(f"{space}Version"):
                key = str(one.findtext(f"{space}Key")).removeprefix(f"{folder}/")
                found[key] = found.get(key, 0) + 1
            if answer.findtext(f"{space}IsTruncated") != "true":
                return found
            more = f"&key-marker={answer.findtext(f'{space}NextKeyMarker')}"

    def read(self, name: str, folder: str) -> dict[str, bytes]:
        """All results."""
        keys = [key for key in self.versions(name, folder) if key != "fleet.json"]
        return {key: self.ask("GET", f"/{name}/{folder}/{key}") for key in keys}

    def end(self) -> None:
        self.process.kill()
        self.process.wait()


def main() -> None:
    dgd = str(Path(sys.argv[1]).absolute())
    server = Server()
    try:
        with tempfile.TemporaryDirectory() as folder:
            check(dgd, server, Path(folder))
    finally:
        server.end()


def check(dgd: str, server: Server, place: Path) -> None:
    path = job(place / "fleet", FITS, [{"kind": "replicates", "count": 50}])
    # A piece that fails has a result, too.
    (place / "fleet" / "w7.csv").write_text("time [s],T [K]\n0,1\n1,x\n")

    def line(what: str, into: str, *more: str) -> list[str]:
        return [dgd, "job", what, str(path), "--into", into, *more]

    def run(what: str, into: str, *more: str, code: int = 0) -> str:
        done = subprocess.run(line(what, into, *more), capture_output=True, text=True, env=server.environment, check=False)
        assert done.returncode == code, f"{what}: {done.returncode}, {done.stdout}{done.stderr}"
        return done.stdout if "json" in more else done.stdout + done.stderr

    def counts(into: str, code: int = 1) -> dict[str, int]:
        return dict(json.loads(run("run", into, "--workers", "2", "--format", "json", code=code)))

    alone = place / "alone"
    began = time.monotonic()
    assert counts(str(alone))["computed"] == FITS
    took = time.monotonic() - began
    expected = results(alone)

    server.bucket("wells")
    assert counts("s3://wells/one")["computed"] == FITS
    assert server.read("wells", "one") == expected, "the bytes are not those in a folder"
    again = counts("s3://wells/one/")
    assert (again["computed"], again["had"], again["failed"]) == (0, FITS, 1)
    print(f"{FITS} fits: the same bytes as in a folder, and a rerun computes nothing")

    said = json.loads(run("status", "s3://wells/one", "--format", "json"))
    assert (said["done"], said["failed"], said["open"]) == (FITS - 1, 1, 0), said
    reports = []
    for into in (str(alone), "s3://wells/one"):
        reports.append(json.loads(run("report", into, "--format", "json")))
    assert reports[0] == reports[1], "reports differ"

    # Four at once, and some of them killed.
    chance, killed = random.Random(28), 0
    into = "s3://wells/many"
    runs: list[subprocess.Popen[bytes]] = []
    until = time.monotonic() + 120 + 30 * took
    while True:
        runs = [one for one in runs if one.poll() is None]
        if killed == KILLS and not runs:
            break
        while killed < KILLS and len(runs) < 4:
            runs.append(
                subprocess.Popen(
                    line("run", into, "--workers", "1", "--quiet"),
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    env=server.environment,
                )
            )
        time.sleep(chance.uniform(0, took / 4))
        if killed < KILLS and (alive := [one for one in runs if is_alive(one.pid)]):
            os.kill(chance.choice(alive).pid, signal.SIGKILL)
            killed += 1
        assert time.monotonic() < until, "the runs do not come to their end"
    counts(into)
    assert server.read("wells", "many") == expected, "the bytes of several runs are others"
    often = {key: n for key, n in server.versions("wells", "many").items() if key.startswith("done/") and n != 1}
    assert not often, f"results were put more than once: {often}"
    print(f"four runs at once, {killed} of them killed: the same bytes, and each result was put once")

    # Failures are computed again where that is asked for, and what is done stays.
    assert counts(into)["computed"] == 0
    retried = json.loads(run("run", into, "--retry", "--format", "json", code=1))
    assert (retried["computed"], retried["failed"]) == (1, 1)
    assert server.read("wells", "many") == expected

    # What belongs to another build stays alone, and what there is not is said.
    other = server.ask("GET", "/wells/one/fleet.json").replace(b"fnv1a-128:", b"fnv1a-128:0")
    server.ask("PUT", "/wells/other/fleet.json", other)
    assert "another build" in run("run", "s3://wells/other", code=1)
    assert "there is no such bucket" in run("run", "s3://nowhere/one", code=1)
    assert "names no bucket" in run("run", "s3://", code=1)
    server.end()
    for what in ("status", "run"):
        assert "s3://wells/one" in run(what, "s3://wells/one", code=1), "no answer was taken for one"
    print("other builds, other buckets and a server that is gone are said")


if __name__ == "__main__":
    main()
