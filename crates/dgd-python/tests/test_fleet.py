"""Fleets on real schedulers and workers of Dask."""

from __future__ import annotations

import dataclasses
import os
import signal
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("distributed")
pytestmark = [
    # Those of Dask's own.
    pytest.mark.filterwarnings("default"),
    pytest.mark.skipif(sys.platform != "linux", reason="processes are looked at in /proc"),
]

import dgd  # noqa: E402
from clusters import Cluster, descendants, is_alive, job, results, run, wait_for  # noqa: E402


def undisturbed(path: Path, folder: Path) -> dict[str, bytes]:
    """What `dgd job run` makes of a job."""
    done = run("job", "run", str(path), "--into", str(folder), "--quiet")
    assert done.returncode == 0, done.stderr
    return results(folder)


def test_a_cluster_gives_the_bytes_of_the_command_and_a_rerun_computes_nothing(tmp_path: Path) -> None:
    path = job(tmp_path, 12, ["fit", {"kind": "profile", "of": ["tau"]}])
    expected = undisturbed(path, tmp_path / "alone")
    with Cluster(2) as cluster:
        fleet = dgd.fleet(path, into=tmp_path / "out", cluster=cluster.address)
        seen = list(fleet)
        assert fleet.computed == len(fleet) == len(seen) == 24
        assert {piece.state for piece in seen} == {"done"}
        assert fleet.refused == {}
    assert results(tmp_path / "out") == expected
    # Nothing is to be computed, so that no scheduler is needed.
    again = dgd.fleet(path, into=tmp_path / "out", cluster="tcp://127.0.0.1:1")
    pieces = again.wait()
    assert again.computed == 0 and [piece.index for piece in pieces] == list(range(24))
    first = pieces[0]
    assert (first.well, first.when, first.what) == ("W-0", "w0", "fit")
    assert first.result is not None and abs(first.result["parameters"]["tau"]["value"] - 80) < 1
    summary = again.summary()
    assert summary["done"] == 24 and len(summary["wells"]) == 12
    again.save(tmp_path / "pages")
    assert (tmp_path / "pages" / "index.html").stat().st_size > 10_000


def test_this_machine_is_a_cluster_and_what_is_there_is_not_computed(tmp_path: Path) -> None:
    path = job(tmp_path, 6, ["fit"])
    assert run("job", "run", str(path), "--into", str(tmp_path / "out"), "--share", "0/2").returncode == 0
    fleet = dgd.fleet(path, into=tmp_path / "out")
    assert len(fleet.wait()) == 6 and fleet.computed == 3


def test_failures_have_reasons_and_are_done_again_when_asked(tmp_path: Path) -> None:
    path = job(tmp_path, 3, ["fit"])
    (tmp_path / "w1.csv").write_text("time [s],T [K]\n0,1\n1,what\n")
    pieces = dgd.fleet(path, into=tmp_path / "out").wait()
    assert [piece.state for piece in pieces] == ["done", "failed", "done"]
    assert pieces[1].result is None and "E6" in (pieces[1].error or "")
    again = dgd.fleet(path, into=tmp_path / "out", retry=True)
    again.wait()
    assert again.computed == 1


def test_a_killed_worker_costs_what_it_was_at_and_leaves_no_orphans(tmp_path: Path) -> None:
    path = job(tmp_path, 20, ["fit", {"kind": "replicates", "count": 200, "each": 100}])
    expected = undisturbed(path, tmp_path / "alone")
    with Cluster(2) as cluster:
        fleet = dgd.fleet(path, into=tmp_path / "out", cluster=cluster.address)
        next(fleet)
        nanny = cluster.workers[0].pid
        wait_for(lambda: len(descendants(nanny)) >= 2)
        below = descendants(nanny)
        for process in below:
            # The worker: its children compute, and its nanny lives.
            if "multiprocessing" in Path(f"/proc/{process}/cmdline").read_text():
                os.kill(process, signal.SIGKILL)
        time.sleep(1)
        orphans = [one for one in below if is_alive(one) and "work" in Path(f"/proc/{one}/cmdline").read_text()]
        assert orphans == []
        fleet.wait()
    assert results(tmp_path / "out") == expected


def test_a_scheduler_that_comes_back_goes_on_with_what_has_no_result(tmp_path: Path) -> None:
    path = job(tmp_path, 30, ["fit", {"kind": "replicates", "count": 60, "each": 30}])
    expected = undisturbed(path, tmp_path / "alone")
    with Cluster(2) as cluster:
        fleet = dgd.fleet(path, into=tmp_path / "out", cluster=cluster.address)
        for _ in range(5):
            next(fleet)
        before = {name: (tmp_path / "out" / name).stat().st_ino for name in results(tmp_path / "out")}
        assert cluster.scheduler is not None
        cluster.scheduler.kill()
        cluster.scheduler.wait()
        for worker in cluster.workers:
            worker.kill()
            worker.wait()
        cluster.mend()
        rest = fleet.wait()
        assert 5 + len(rest) == len(fleet)
    assert results(tmp_path / "out") == expected
    after = {name: (tmp_path / "out" / name).stat().st_ino for name in before}
    assert after == before, "no finished piece was computed again"


def test_a_scheduler_that_stays_away_is_told(tmp_path: Path) -> None:
    path = job(tmp_path, 1, ["fit"])
    fleet = dgd.fleet(path, into=tmp_path / "out", cluster="tcp://127.0.0.1:1", patience=1)
    with pytest.raises(dgd.DgdError, match="no scheduler at tcp://127.0.0.1:1.*goes on"):
        next(fleet)


def test_workers_of_another_build_are_refused(tmp_path: Path) -> None:
    path = job(tmp_path, 2, ["fit"])
    with Cluster(1) as cluster:
        fleet = dgd.fleet(path, into=tmp_path / "out", cluster=cluster.address)
        other = {**fleet._listing.identity, "build": "fnv1a-128:" + 32 * "0"}
        fleet._listing = dataclasses.replace(fleet._listing, identity=other)
        with (
            pytest.warns(dgd.DgdWarning, match="another build of dgd .*, [0-9a-f]{8} and not 00000000"),
            pytest.raises(dgd.DgdError, match="no worker computes pieces"),
        ):
            next(fleet)
    assert results(tmp_path / "out") == {}


@pytest.mark.parametrize(
    ("asked", "reason"),
    [({"memory": "100 GB"}, "may take 1.0 GB of memory, and a piece 100.0 GB"), ({"threads": 2}, "a piece takes 2")],
)
def test_workers_without_room_for_a_piece_are_refused(
    tmp_path: Path, asked: dict[str, object], reason: str
) -> None:
    path = job(tmp_path, 2, ["fit"])
    with Cluster(1, "--memory-limit", "1GB") as cluster:
        fleet = dgd.fleet(path, into=tmp_path / "out", cluster=cluster.address, **asked)  # type: ignore[arg-type]
        with pytest.warns(dgd.DgdWarning, match=reason), pytest.raises(dgd.UsageError, match=reason):
            next(fleet)


def test_buckets_are_refused(tmp_path: Path) -> None:
    path = job(tmp_path, 2, ["fit"])
    with pytest.raises(dgd.UsageError, match="lie in a folder"):
        dgd.fleet(path, into="s3://bucket/results")
    assert not Path("s3:").exists()


def test_a_job_that_makes_no_sense_is_refused(tmp_path: Path) -> None:
    path = job(tmp_path, 1, [])
    path.write_text('{ "model": "cup.dgd", "do": ["fitt"], "wells": { "a": "w0.csv" } }')
    with pytest.raises(dgd.DataError, match="did you mean `fit`"):
        dgd.fleet(path, into=tmp_path / "out")
    with pytest.raises(dgd.UsageError, match='memory="much"'):
        dgd.fleet(job(tmp_path, 1, ["fit"]), into=tmp_path / "out", memory="much")
