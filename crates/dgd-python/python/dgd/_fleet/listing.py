"""The pieces that the command lists, and their results in the store."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .._errors import DataError, UsageError

#: How this program's command is started.
COMMAND = (sys.executable, "-m", "dgd")


@dataclass(frozen=True)
class Piece:
    """A piece of work that has a result."""

    #: Its number in the job, from 0.
    index: int
    #: Its name, a digest of build, model, data and options.
    name: str
    well: str
    #: When its recordings were made, as the job says it.
    when: str
    #: What was done, such as ``"fit"`` or ``"start 3 of 20"``.
    what: str
    #: ``"done"`` or ``"failed"``.
    state: str
    #: The file with its result.
    path: Path
    _cache: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def document(self) -> dict[str, Any]:
        """The contents of the file."""
        if not self._cache:
            self._cache.update(json.loads(self.path.read_text(encoding="utf-8")))
        return self._cache

    @property
    def result(self) -> dict[str, Any] | None:
        """The JSON result of the command; None if it failed."""
        result: dict[str, Any] | None = self.document.get("result")
        return result

    @property
    def error(self) -> str | None:
        """The reason of the failure."""
        error: str | None = self.document.get("error")
        return error


@dataclass(frozen=True)
class Listed:
    """A piece as the command lists it."""

    index: int
    what: str
    path: Path
    #: What a worker is asked to do.
    task: dict[str, Any]

    @property
    def name(self) -> str:
        """The piece's name."""
        return str(self.task["name"])

    def found(self) -> Piece | None:
        """The piece with its result, if the store has one by now."""
        for state in ("done", "failed"):
            # …/STATE/ab/abcd….json
            path = self.path.parents[2] / state / self.path.parent.name / self.path.name
            if path.exists():
                piece = self.task["piece"]
                return Piece(self.index, self.name, piece["well"], piece["when"], self.what, state, path)
        return None


@dataclass(frozen=True)
class Listing:
    """All pieces of a job."""

    #: The build and the type of machine that computes them.
    identity: dict[str, str]
    #: Threads for a piece, and most memory, bytes.
    threads: int
    memory: int | None
    pieces: list[Listed]

    @staticmethod
    def of(job: Path, into: Path, threads: int | None) -> Listing:
        """The pieces listed by the command."""
        words = ["job", "tasks", str(job), "--into", str(into)]
        if threads is not None:
            words += ["--threads", str(threads)]
        lines = _lines(words)
        head = next(lines, None)
        if head is None:
            raise DataError(f"nothing is listed of {job}")
        pieces = [
            Listed(one["index"], one["what"], into / Path(one["path"]).relative_to(into), one["task"])
            for one in lines
        ]
        return Listing(head["identity"], head["threads"], head["memory"], pieces)


def _lines(words: list[str]) -> Iterator[dict[str, Any]]:
    with subprocess.Popen(
        [*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8"
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        for line in process.stdout:
            yield json.loads(line)
        said = process.stderr.read().strip().removeprefix("error: ")
    if process.returncode == 2:
        raise UsageError(said)
    if process.returncode != 0:
        raise DataError(said)


def said(words: list[str]) -> str:
    """The output of the command."""
    done = subprocess.run(
        [*COMMAND, *words], capture_output=True, text=True, encoding="utf-8", check=False
    )
    if done.returncode != 0:
        raise DataError(done.stderr.strip().removeprefix("error: "))
    return done.stdout
