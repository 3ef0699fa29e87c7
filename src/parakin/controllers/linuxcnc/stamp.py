"""Stamp the files of a configuration with a hash of their text, and tell by it which ones were edited since."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path

_COMMENTS = {
    ".c": "/* {} */",
    ".h": "/* {} */",
    ".ini": "# {}",
    ".hal": "# {}",
    ".py": "# {}",
    ".tbl": "; {}",
    ".ngc": "({})",
    ".md": "<!-- {} -->",
    ".xml": "<!-- {} -->",
}
_TEXT = "as parakin wrote it: {}"
_STAMP = re.compile(rb"\n[^\n]*as parakin wrote it: ([0-9a-f]{16})[^\n]*\n?\Z")
_LONGEST = 10_000_000  # bytes; what parakin writes is shorter


def stamp_file(name: str, text: str) -> str:
    """Add a last line, a comment of the file's own kind, with a hash of the text above it."""
    text = text.rstrip("\n")
    return f"{text}\n{_COMMENTS[Path(name).suffix].format(_TEXT.format(_hash_text(text.encode())))}\n"


def find_edited_files(folder: str | os.PathLike[str], names: Iterable[str]) -> list[Path]:
    """Find the files of a folder that are not as parakin wrote them: edited, of another origin, or not to be read."""
    paths = [Path(folder) / name for name in names]
    return [path for path in paths if path.is_file() and not _is_as_written(path)]


def _is_as_written(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            content = file.read(_LONGEST)
    except OSError:
        return False
    content = content.replace(b"\r\n", b"\n")  # as some editors and version controls have it
    stamp = _STAMP.search(content)
    return stamp is not None and stamp[1].decode() == _hash_text(content[: stamp.start()])


def _hash_text(text: bytes) -> str:
    return sha256(text).hexdigest()[:16]
