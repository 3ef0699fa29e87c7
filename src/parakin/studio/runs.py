"""Commands that run in processes of their own, which can be cancelled: a few at once, bounded in time and output."""

from __future__ import annotations

import asyncio
import os
import shlex
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from .parent_watch import PATIENCE

_AT_ONCE = 2
_LONGEST = 900.0  # s
_MOST_OUTPUT = 1_000_000  # bytes that are kept, of each stream

State = Literal["waiting", "running", "done", "cancelled", "too long"]


@dataclass
class Run:
    """A command that runs, or ran: its words, what it printed, in lines of so many letters, and its exit code."""

    words: Sequence[str]
    folder: Path
    columns: int
    state: State = "waiting"
    code: int | None = None
    output: bytearray = field(default_factory=bytearray)
    errors: bytearray = field(default_factory=bytearray)
    begun: float = field(default_factory=time.monotonic)
    ended: float | None = None

    @property
    def line(self) -> str:
        """The command line that does the same."""
        return shlex.join(["parakin", *self.words])

    @property
    def is_open(self) -> bool:
        """Whether it waits or runs."""
        return self.ended is None

    @property
    def seconds(self) -> float:
        """For how long it has run, or waited."""
        return (time.monotonic() if self.ended is None else self.ended) - self.begun


class RunQueue:
    """Runs commands, at most two at once, in the order in which they came."""

    def __init__(self) -> None:
        self._slots = asyncio.Semaphore(_AT_ONCE)
        self._tasks: dict[int, asyncio.Task[None]] = {}
        self._watched, self._held = os.pipe()  # what this process holds closes with it, and what it began sees that

    def begin(self, words: Sequence[str], folder: Path, columns: int) -> Run:
        """Begin a command in a folder, when there is room; it prints for lines of so many letters."""
        run = Run(words, folder, columns)
        self._tasks[id(run)] = asyncio.get_running_loop().create_task(self._run_in_turn(run))
        return run

    async def cancel(self, run: Run) -> None:
        """Cancel a run; one that is done stays as it is."""
        task = self._tasks.get(id(run))
        if task is not None and not task.done():
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    async def cancel_all(self) -> None:
        """Cancel every run."""
        for task in self._tasks.values():
            task.cancel()
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)

    async def _run_in_turn(self, run: Run) -> None:
        try:
            async with self._slots:
                run.state, run.begun = "running", time.monotonic()
                await self._run_process(run)
        except asyncio.CancelledError:
            run.state = "cancelled"
        except TimeoutError:
            run.state = "too long"
        finally:
            run.ended = time.monotonic()
            self._tasks.pop(id(run), None)

    async def _run_process(self, run: Run) -> None:
        begin = ["-P", "-m", "parakin.studio.parent_watch", str(self._watched)]  # -P: a file in the folder is no module
        process = await asyncio.create_subprocess_exec(
            sys.executable, *begin, "parakin", *run.words, pass_fds=[self._watched],
            cwd=run.folder, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE, start_new_session=True,
            env={**os.environ, "COLUMNS": str(run.columns), "NO_COLOR": "1", "PYTHONPATH": _find_import_path()},
        )  # fmt: skip
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            async with asyncio.timeout(_LONGEST):
                await asyncio.gather(_keep(process.stdout, run.output), _keep(process.stderr, run.errors))
                run.code = await process.wait()
        finally:
            if process.returncode is None:
                await _end_process(process)
        run.state = "done"


def _find_import_path() -> str:
    """Find the entries of PYTHONPATH from where the studio runs; an empty or relative one would be a run's folder."""
    given = os.environ.get("PYTHONPATH")
    return os.pathsep.join(str(Path(entry).absolute()) for entry in given.split(os.pathsep)) if given else ""


async def _keep(stream: asyncio.StreamReader, kept: bytearray) -> None:
    """Keep the begin of a stream, and read the rest of it."""
    while block := await stream.read(65536):
        kept += block[: max(0, _MOST_OUTPUT - len(kept))]


async def _end_process(process: asyncio.subprocess.Process) -> None:
    """End a process with all that it began: asked first, then at once."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        with suppress(TimeoutError):
            async with asyncio.timeout(PATIENCE):
                await process.wait()
                return
