"""Compile the kernels that Numba keeps beside their sources: once, before several processes run the tests.

``python tests/compile_kernels.py`` takes two processes. What it leaves out is compiled by the test that comes to it.
"""

from __future__ import annotations

import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import parakin as pk
from parakin.cli import main

PART = "UNITS/MM\nFEDRAT/1000,MMPM\nGOTO/0,0,-1650,0,0,1\nGOTO/10,0,-1650\nGOTO/10,20,-1660\n"


def write_part(folder: str) -> str:
    path = Path(folder) / "part.cls"
    path.write_text(PART)
    return str(path)


def compile_timing() -> None:
    """Post a part: its trajectory, and its joints as a table."""
    with tempfile.TemporaryDirectory() as folder:
        assert main(["post", write_part(folder), "-m", "tricept", "-o", folder]) == 0


def compile_bounds() -> None:
    """Find all poses of six struts, bound a workspace, and turn the tool about its axis."""
    machine, plane = pk.load("hexapod"), pk.load("five_bar")
    machine.assemblies(machine.inverse(machine.home))
    pk.workspace(pk.region(plane), gap=0.3)
    with tempfile.TemporaryDirectory() as folder:
        pk.choose_tool_turn(machine, pk.read_path(write_part(folder)), workpiece=pk.workpiece(Z=700.0))


if __name__ == "__main__":
    with ProcessPoolExecutor(2) as pool:
        for job in [pool.submit(compile_timing), pool.submit(compile_bounds)]:
            job.result()
