"""Compile kernels with Numba, and keep them on disk where that is possible.

Numba's own ``cache=True`` raises where there is no folder to write to, and where a cached file is damaged. Here the
first costs compiling in every process, and the second compiling once more.
"""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Callable
from functools import cache
from time import monotonic
from typing import Any

import numba
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile

from ..budget import CLOCK
from .compile_notice import report_compilation

_CHECKSUM = 4  # bytes


class _Listener(event.Listener):  # type: ignore[misc]
    """Passes on that Numba compiles, and how long; a kernel compiles those that it calls within."""

    def __init__(self) -> None:
        self.depth, self.began = 0, 0.0

    def on_start(self, event: object) -> None:
        if not self.depth:
            self.began = monotonic()
        self.depth += 1
        report_compilation()

    def on_end(self, event: object) -> None:
        self.depth -= 1
        if not self.depth:
            CLOCK.compiling += monotonic() - self.began


event.register("numba:compile", _Listener())


class DamagedCacheError(Exception):
    """A cached kernel is not what was written."""


class _CheckedFile(IndexDataCacheFile):  # type: ignore[misc]
    """A cache file whose machine code carries a checksum: damaged code would crash the process."""

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(zlib.crc32(content).to_bytes(_CHECKSUM, "little") + content)

    def _load_data(self, name: str) -> Any:
        from numba.core.serialize import pickle

        with open(self._data_path(name), "rb") as file:  # noqa: PTH123  as Numba does
            content = file.read()
        if zlib.crc32(content[_CHECKSUM:]).to_bytes(_CHECKSUM, "little") != content[:_CHECKSUM]:
            raise DamagedCacheError(name)
        return pickle.loads(content[_CHECKSUM:])


class _TolerantCache(FunctionCache):  # type: ignore[misc]
    """A cache of kernels that is empty where it can't be read, and is not added to where it can't be written."""

    def __init__(self, function: Callable[..., Any]):
        super().__init__(function)
        locator = self._impl.locator
        base = self._impl.filename_base
        self._cache_file = _CheckedFile(locator.get_cache_path(), base, locator.get_source_stamp())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever a damaged pickle raises
            self._clear()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except OSError:  # a full disk, a folder that is locked
            return

    def _clear(self) -> None:
        try:
            self.flush()
        except OSError:
            self.disable()


def njit(*, cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function as ``numba.njit`` does, but never fail because of the cache."""

    def compile_function(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**options)(function)
        if cache:
            try:
                kernel._cache = _TolerantCache(function)
            except RuntimeError:  # no folder can be written
                _warn_of_no_cache()
        return kernel

    return compile_function


@cache
def _warn_of_no_cache() -> None:
    warnings.warn(
        "nowhere to keep the compiled kernels, they are compiled in every process; set NUMBA_CACHE_DIR to a folder of "
        "yours",
        RuntimeWarning,
        stacklevel=2,
    )
