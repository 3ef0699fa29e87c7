"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO

from ..errors import InputError

Content = bytes | str | Callable[[BinaryIO], None]


def write_all(folder: str | os.PathLike[str], files: Mapping[str, Content]) -> list[Path]:
    """Write files into a folder, made if need be; returns their paths.

    Parameters
    ----------
    folder : where to
    files : by their names: bytes, text (UTF-8), or what writes itself to an open binary file

    All are written under other names first and take their own ones when every one is complete, so that a full disk or
    an interruption leaves what was there before.

    Raises :class:`InputError` if the folder can't be made or a file can't be written.
    """
    base = Path(folder)
    targets = [base / name for name in files]
    written: list[str] = []
    place = str(base)
    try:
        base.mkdir(parents=True, exist_ok=True)
        for target, content in zip(targets, files.values(), strict=True):
            place = str(target)
            if target.exists() and not target.is_file():  # a folder, or a device such as /dev/null
                raise InputError("is no plain file, it can't be replaced by one", place)
            handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=base)
            written.append(temporary)
            with os.fdopen(handle, "wb") as file:
                _fill(file, content)
            os.chmod(temporary, 0o666 & ~_umask())  # noqa: PTH101  a temporary file is its owner's only
        for target, temporary in zip(targets, written, strict=True):
            place = str(target)
            os.replace(temporary, target)  # noqa: PTH105
    except OSError as error:
        raise InputError(f"can't be written: {error.strerror or error}", place) from error
    finally:
        for temporary in written:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(temporary)  # noqa: PTH108
    return targets


def _fill(file: BinaryIO, content: Content) -> None:
    if isinstance(content, str):
        content = content.encode()
    if isinstance(content, bytes):
        file.write(content)
    else:
        content(file)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
