"""Random CL programs in Siemens NX's words against an independent model of what they say: units, frames, arcs, cycles.

PARAKIN_PROGRAMS sets how many are made.
"""

import os

from cl_model import ClProgram
from cl_reading import both_reader

from parakin.errors import InputError

COUNT = int(os.environ.get("PARAKIN_PROGRAMS", "400")) // 10


def test_random_programs(tmp_path, monkeypatch):
    read, compared = both_reader(tmp_path, monkeypatch), 0
    for seed in range(COUNT):
        program = ClProgram(seed)
        try:
            path = read(program.text)
        except InputError as error:  # a cut may happen to join an arc from the wrong side
            assert "contradicts the motion that joins it" in error.message, (seed, error)
            continue
        try:
            program.verify(path)
        except AssertionError as error:
            raise AssertionError(f"seed {seed}\n{program.text}") from error
        compared += 1
    assert compared > 0.8 * COUNT
