"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

from ..arrays import Writer
from ..errors import InputError

Content = bytes | str | Writer


def write_files(folder: str | os.PathLike[str], files: Mapping[str, Content]) -> list[Path]:
    """Write files into a folder, which is made if it is missing; return their paths.

    Parameters
    ----------
    folder : where to
    files : by their names: bytes, text (UTF-8), or a writer to an open binary file

    All are written under other names first and are renamed when every one is complete, so that a full disk or an
    interruption leaves what was there before.

    Raises :class:`InputError` if the folder can't be made or a file can't be written.
    """
    base = Path(folder)
    targets = [base / name for name in files]
    written: list[str] = []
    current = str(base)  # for the error's message
    try:
        base.mkdir(parents=True, exist_ok=True)
        for target, content in zip(targets, files.values(), strict=True):
            current = str(target)
            if target.exists() and not target.is_file():  # a folder, or a device such as /dev/null
                raise InputError("is no plain file, it can't be replaced by one", current)
            handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=base)
            written.append(temporary)
            with os.fdopen(handle, "wb") as file:
                _write_content(file, content)
            os.chmod(temporary, 0o666 & ~_read_umask())  # noqa: PTH101  a temporary file is its owner's only
        for target, temporary in zip(targets, written, strict=True):
            current = str(target)
            os.replace(temporary, target)  # noqa: PTH105
    except OSError as error:
        raise InputError(f"can't be written: {error.strerror or error}", current) from error
    finally:
        for temporary in written:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(temporary)  # noqa: PTH108
    return targets


def _write_content(file: BinaryIO, content: Content) -> None:
    if isinstance(content, str):
        content = content.encode()
    if isinstance(content, bytes):
        file.write(content)
    else:
        content(file)


def _read_umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
