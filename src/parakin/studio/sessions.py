"""A session of the studio: one page with its files and its runs."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import NamedTuple
from zipfile import ZIP_DEFLATED, ZipFile

from ..errors import InputError, quote
from .forms import FILE_NAME, FILE_NAME_WORDS
from .runs import Run

_MOST_SESSIONS = 20
_MOST_RUNS = 100  # that a session remembers
_MOST_BYTES = 2**30  # of a session's files
_MOST_FILES = 500
_LARGEST_FILE = 64 * 2**20  # bytes


class SessionFile(NamedTuple):
    """A file's name, size in bytes, and when it was last written, s."""

    name: str
    size: int
    written: float


@dataclass
class Session:
    """A page's folder and the commands that it ran, the oldest first."""

    folder: Path
    runs: dict[int, Run] = field(default_factory=dict)
    count: int = 0

    @property
    def is_busy(self) -> bool:
        """Whether a command runs or waits."""
        return any(run.is_open for run in self.runs.values())

    def add_run(self, run: Run) -> int:
        """Add a run under a number, and drop the oldest where there are too many."""
        self.count += 1
        self.runs[self.count] = run
        over = [number for number, one in self.runs.items() if not one.is_open][: max(0, len(self.runs) - _MOST_RUNS)]
        for number in over:
            del self.runs[number]
        return self.count

    def find_file(self, name: str) -> Path:
        """Find where a file of a name lies, or would lie; a name may have folders before it.

        Raises :class:`InputError` for a name that leads elsewhere.
        """
        words = name.split("/")
        if not all(FILE_NAME.fullmatch(word) and not word.endswith((".", " ")) for word in words):
            raise InputError(f"{quote(name)} is not {FILE_NAME_WORDS}")
        path = self.folder.joinpath(*words)
        if not path.resolve().is_relative_to(self.folder.resolve()):
            raise InputError(f"{quote(name)} leads out of the session's folder")
        return path

    def list_files(self) -> list[SessionFile]:
        """List the files, those in folders too."""
        paths = sorted(path for path in self.folder.rglob("*") if path.is_file() and not path.name.startswith("."))
        listed = []
        for path in paths[:_MOST_FILES]:
            with suppress(FileNotFoundError):  # a command replaces it
                about = path.stat()
                listed.append(SessionFile(path.relative_to(self.folder).as_posix(), about.st_size, about.st_mtime))
        return listed

    def pack_files(self, folder: str) -> bytes:
        """Pack the files of a folder, or all where none is named, into a .zip.

        Raises :class:`InputError` where there are none.
        """
        inside = self.folder if not folder else self.find_file(folder)
        packed, count = BytesIO(), 0
        with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
            for file in self.list_files():
                path = self.folder / file.name
                if path.is_relative_to(inside):
                    with suppress(FileNotFoundError):  # a command replaces it
                        archive.write(path, file.name)
                        count += 1
        if not count:
            raise InputError(f"{quote(folder)} is no folder with files")
        return packed.getvalue()

    def measure_room(self) -> int:
        """Measure how large one more file may be, bytes."""
        return max(0, min(_LARGEST_FILE, _MOST_BYTES - sum(file.size for file in self.list_files())))

    def find_place(self, name: str) -> Path:
        """Find where a file of a name is written; raises :class:`InputError` for a name that none can have."""
        path = self.find_file(name)
        if len(path.relative_to(self.folder).parts) != 1 or path.is_dir():
            raise InputError(f"{quote(name)} is not {FILE_NAME_WORDS}, or is a folder")
        return path

    def write_file(self, name: str, content: bytes) -> None:
        """Write a file whole."""
        path = self.find_place(name)
        half = path.with_name(f".{path.name}.half")
        half.write_bytes(content)
        half.replace(path)


class Sessions:
    """All sessions, each with a folder of its own that begins with copies of the given files."""

    def __init__(self, folder: Path, given: Sequence[Path]):
        self._folder, self._given = folder, given
        self._open: dict[str, Session] = {}

    def open_session(self) -> str:
        """Open a session; where there are too many, the one that was not asked for the longest is closed.

        Raises :class:`InputError` where all have commands that run.
        """
        if len(self._open) >= _MOST_SESSIONS:
            idle = [name for name, session in self._open.items() if not session.is_busy]
            if not idle:
                raise InputError(f"{_MOST_SESSIONS} pages have commands that run; cancel one")
            shutil.rmtree(self._open.pop(idle[0]).folder)
        name = secrets.token_hex(8)
        session = Session(self._folder / name)
        session.folder.mkdir()
        for path in self._given:
            shutil.copyfile(path, session.folder / path.name)
        self._open[name] = session
        return name

    def find_session(self, name: str) -> Session | None:
        """Find a session by its name, which makes it the last that was asked for."""
        if name in self._open:
            self._open[name] = self._open.pop(name)
        return self._open.get(name)
