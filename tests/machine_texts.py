"""What the tests of machine files share: a good file, and the errors of a bad one."""

from __future__ import annotations

from pathlib import Path

import pytest

from parakin.description import read_machine
from parakin.errors import InputError

RPR3 = Path(__file__).parent / "machines" / "rpr3.yaml"
GOOD = """\
name: bench
source: Sizes were chosen.
sizes:
  R: 500 mm
  r: 0.2 * R
motion: tx ty rz
legs:
  kind: length
  joints: [q1, q2, q3]
  foot: {circle: R, at: [90 deg, 210 deg, 330 deg]}
  platform: {circle: r, at: [90 deg, 210 deg, 330 deg]}
  range: [200 mm, 650 mm]
head:
  - rz: {joint: turn, range: [-90 deg, 90 deg], reverse: true, offset: 90 deg, speed: 10 rpm}
  - tz: -r
limits:
  gaps: [{between: [q1, q2], range: [-300 mm, 300 mm]}]
  clearance: 50 mm
home: {X: 0 mm, Y: 0 mm, C: 0 deg}
"""


def write(tmp_path, text, name="m.yaml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def errors_of(tmp_path, text, parameters=None):
    """The lines of the error, without the folder."""
    with pytest.raises(InputError) as caught:
        read_machine(write(tmp_path, text), parameters)
    return str(caught.value).replace(f"{tmp_path}/", "").split("\n")
