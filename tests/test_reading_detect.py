"""Which reader a file is for."""

import pytest

from parakin.toolpath.reading.detect import detect_format, read_path


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        *[(f"a{suffix}", "GOTO/1,2,3\n", "gcode") for suffix in (".ngc", ".nc", ".NC", ".gcode", ".tap", ".cnc")],
        ("a.cls", "TOOL PATH/A,TOOL,B\n", "cl"),
        ("a.apt", "PARTNO X\n", "cl"),
        *[(f"a{suffix}", "P1=POINT/0,0,0\n", "cl") for suffix in (".apt", ".aptsource", ".CLS", ".cl", ".ncl")],
        ("a", "$$ -----\n$$ (text)\n", "cl"),
        ("a.txt", "\n\n  goto/ 1,2,3\n", "cl"),
        ("a.txt", "UNITS / MM\n", "cl"),
        ("a.txt", "FROM/0,0,0", "cl"),
        ("a.txt", "RAPID\n", "cl"),
        ("a.txt", "MULTAX\nG0", "cl"),
        ("a.txt", "%\nO0001\n", "gcode"),
        ("a.txt", "\n\r\n(header)\n", "gcode"),
        ("a.txt", "; header\n", "gcode"),
        ("a.txt", "\ufeffN10 G0 X1\n", "gcode"),
        ("a.txt", "/ g 0 x1\n", "gcode"),
        ("a.txt", "X.5\n", "gcode"),
        ("a.txt", "M6\n", "gcode"),
        ("a.txt", "T1\nGOTO/1,2,3\n", "gcode"),
        ("a.txt", "hello\nG0 X1\n", "gcode"),
        ("a.txt", "", "cl"),
        ("a.txt", "\0\1", "cl"),
    ],
)
def test_which_reader(tmp_path, name, text, kind):
    path = tmp_path / name
    path.write_text(text)
    assert detect_format(path) == kind


def test_any_file(tmp_path):
    (tmp_path / "a").write_text("G0 X1 Y2 Z3\nG2 X3 I1 F5\n")
    (tmp_path / "b").write_text("FEDRAT/5\nGOTO/1,2,3\nGOTO/3,2,3\n")
    seen = []
    a, b = read_path(tmp_path / "a", arc_tolerance=0.5, progress=seen.append), read_path(tmp_path / "b")
    assert (a.dialect, b.dialect) == ("gcode", "apt") and seen[-1] == 1.0
    assert a.line.tolist() == [1, 2, 2, 2, 2] and b.tip.tolist() == [[1, 2, 3], [3, 2, 3]]
