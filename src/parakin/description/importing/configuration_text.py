"""Text of configurations, and the files beside them that they name."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError, quote

_LARGEST = 1 << 22  # bytes of a configuration


def read_configuration(path: Path) -> str:
    """Read a configuration in words.

    Raises :class:`InputError` for one that can't be read, is too large, or is binary.
    """
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
    except OSError as error:
        raise InputError(f"can't be read: {error.strerror or error}", str(path)) from error
    if len(content) > _LARGEST or b"\0" in content:
        raise InputError("is no configuration in words", str(path))
    return content.decode("utf-8", "replace")


def check_beside(file: Path, folders: tuple[Path, ...], word: str, source: str, line: int | None = None) -> Path:
    """Return a file that another one names by ``word``, if it lies within one of the folders.

    A file from somebody else opens nothing but what came with it.

    Raises :class:`InputError` for a file elsewhere.
    """
    if not any(file.resolve().is_relative_to(folder.resolve()) for folder in folders):
        message = f"{word} {quote(file.name)} is outside of the folder of the file that names it; copy it there"
        raise InputError(message, source, line)
    return file
