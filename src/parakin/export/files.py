"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from ..arguments import check_arguments
from ..arrays import Writer
from ..errors import InputError, quote

try:
    import fcntl
except ImportError:  # no locks on this system: leftovers stay
    fcntl = None  # type: ignore[assignment]

Content = bytes | str | Writer

_BEGIN, _END = ".parakin-", ".part"  # of the name of a folder of files that are not complete yet
_NOTE = "parakin-incomplete-"  # begin of the name of a note on files that do not belong together yet
_NOTE_TEXT = "These files were being replaced together, and may be old and new ones; run the command again."
_TRIES = 3  # attempts to make such a folder and lock it before another process sweeps it
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@check_arguments
def write_files(folder: str | os.PathLike[str], files: Mapping[str, Content]) -> list[Path]:
    """Write files into a folder, which is made if it is missing; return their paths.

    Parameters
    ----------
    folder : where to
    files : by their names: bytes, text (UTF-8), or a writer to an open binary file

    All are written into a hidden folder first and move when every one is complete, so that a full disk or an
    interruption leaves what was there before. A folder that is missing appears with all of them at once. What a killed
    process has left behind is removed. Where several files replace others one after the other, a note stands beside
    them meanwhile: should it stay, the process was killed, and old and new files may be mixed.

    Raises :class:`InputError` if the folder can't be made or a file can't be written.
    """
    base = Path(folder)
    _check_path(str(base), "folder")
    for name in files:
        _check_path(name, "files")
        if not name or Path(name).name != name:
            raise InputError(f"{quote(name)} is no file name, expected one without a folder", "files")
    targets = [base / name for name in files]
    current = str(base)  # for the error's message
    try:
        is_new = not base.exists()
        if is_new and base.name not in ("", ".."):
            base.parent.mkdir(parents=True, exist_ok=True)
        else:
            base.mkdir(parents=True, exist_ok=True)
        with _open_stage(base.parent if is_new else base) as stage:
            for target, content in zip(targets, files.values(), strict=True):
                current = str(target)
                if target.exists() and not target.is_file():  # a folder, or a device such as /dev/null
                    raise InputError("is no plain file, it can't be replaced by one", current)
                with (stage / target.name).open("xb") as file:
                    _write_content(file, content)
            current = str(base)
            if is_new and _rename_folder(stage, base):
                return targets
            base.mkdir(exist_ok=True)
            with _delay_signals(), _note_incomplete(base, stage, files):
                for target in targets:
                    current = str(target)
                    os.replace(stage / target.name, target)  # noqa: PTH105
    except OSError as error:
        raise InputError(f"can't be written: {error.strerror or error}", current) from error
    return targets


def _check_path(path: str, source: str) -> None:
    """Refuse a path that no file can have: one with a zero character, or that is no text of the file system."""
    try:
        encoded = os.fsencode(path)
    except UnicodeEncodeError:
        encoded = b"\0"
    if b"\0" in encoded:
        raise InputError(f"{quote(path)} is no path", source)


@contextlib.contextmanager
def _open_stage(base: Path) -> Iterator[Path]:
    """Make a hidden folder, locked as long as this process lives, and remove it at the end."""
    _sweep_leftovers(base)
    for _ in range(_TRIES):
        stage = Path(tempfile.mkdtemp(prefix=_BEGIN, suffix=_END, dir=base))
        lock = _lock_folder(stage)
        if lock is not None or stage.exists():  # else another process took it for a leftover
            break
    try:
        yield stage
    finally:
        if lock is not None:
            os.close(lock)
        shutil.rmtree(stage, ignore_errors=True)


def _lock_folder(folder: Path) -> int | None:
    """Lock a folder for this process; None where it is locked, or there are no locks."""
    if fcntl is None:
        return None
    handle = None
    try:
        handle = os.open(folder, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if handle is not None:
            os.close(handle)
        return None
    return handle


def _sweep_leftovers(base: Path) -> None:
    """Remove the hidden folders of processes that have ended."""
    for folder in base.glob(f"{_BEGIN}*{_END}"):
        lock = None if folder.is_symlink() else _lock_folder(folder)
        if lock is not None:
            shutil.rmtree(folder, ignore_errors=True)
            os.close(lock)


@contextlib.contextmanager
def _note_incomplete(base: Path, stage: Path, names: Iterable[str]) -> Iterator[None]:
    """Keep a note in a folder while files of a set appear there; then also remove the notes of sets they complete."""
    names = sorted(names)
    if len(names) < 2:
        yield
        return
    note = f"{_NOTE}{stage.name.removeprefix(_BEGIN).removesuffix(_END)}.txt"
    (stage / note).write_text("\n".join([_NOTE_TEXT, *names, ""]), encoding="utf-8", errors="backslashreplace")
    os.replace(stage / note, base / note)  # noqa: PTH105
    yield
    for other in base.glob(f"{_NOTE}*.txt"):
        listed = other.read_text(encoding="utf-8", errors="replace").splitlines()
        if listed[:1] == [_NOTE_TEXT] and set(listed[1:]) <= set(names):
            other.unlink(missing_ok=True)


def _rename_folder(stage: Path, base: Path) -> bool:
    """Rename the hidden folder to the requested one; False where another process made that first."""
    stage.chmod(0o777 & ~_read_umask())
    try:
        os.rename(stage, base)  # noqa: PTH104
    except OSError:
        if base.is_dir():
            return False
        raise
    return True


@contextlib.contextmanager
def _delay_signals() -> Iterator[None]:
    """Delay interruptions until a set of files is complete."""
    if threading.current_thread() is not threading.main_thread():  # handlers run in the main thread only
        yield
        return
    received: list[int] = []
    handlers = {number: signal.signal(number, lambda n, frame: received.append(n)) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for first in received[:1]:
            signal.raise_signal(first)


def _write_content(file: BinaryIO, content: Content) -> None:
    if isinstance(content, str):
        content = content.encode("utf-8", "backslashreplace")  # a file's name may be no text
    if isinstance(content, bytes):
        file.write(content)
    else:
        content(file)


def _read_umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
