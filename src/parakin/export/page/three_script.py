"""three.js, as the installed trimesh brings it: a library for 3D in the browser, under the MIT licence."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from ...errors import NoMethodError

REVISION = "140"
_PLACE = ("resources", "templates", "viewer.zip")
_TEMPLATE = "viewer.html.template"
_LICENCE = "/* three.js, Copyright 2010-2022 Three.js Authors, SPDX-License-Identifier: MIT */\n"


def read_three_script() -> str:
    """Read the script that defines the global ``THREE``, with its licence.

    Raises :class:`NoMethodError` where the installed trimesh does not bring it in the known place.
    """
    package = find_spec("trimesh")  # which is not imported: it takes a third of a second
    folders = [] if package is None else package.submodule_search_locations or []
    try:
        with ZipFile(Path(*folders, *_PLACE)) as stored:
            lines = stored.read(_TEMPLATE).decode("utf-8").splitlines()
    except (OSError, BadZipFile, KeyError, UnicodeDecodeError):
        lines = []
    scripts = [line for line in lines if line.startswith("!function") and f'="{REVISION}"' in line]
    if len(scripts) != 1:
        raise NoMethodError(
            f"three.js r{REVISION} is not in {'/'.join(_PLACE)} of the installed trimesh, which a page takes it from"
        )
    return _LICENCE + scripts[0]
