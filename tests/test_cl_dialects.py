"""The CL dialects of the CAM systems in use: their arcs, cycles, frames and feeds against geometry written by hand."""

import contextlib
import math
import random
import re
import time

import numpy as np
import pytest

from parakin.errors import InputError
from parakin.toolpath.reading.cl.dialects import DIALECTS
from parakin.toolpath.reading.cl.reader import read_cl
from parakin.toolpath.reading.cl.words import INFORMING, REFUSED, WORDS
from parakin.toolpath.reading.detect import detect_format, read_path

CREO_HEADER = "$$*  Pro/CLfile  Version 12.0\n"
CREO_CSYS = """\
$$*         Pro/CLfile  Version 12.0
$$-> MFGNO / MFG0001
PARTNO / MFG0001
$$-> FEATNO / 42
MACHIN / UNCX01, 01
$$-> CUTCOM_GEOMETRY_TYPE / OUTPUT_ON_CENTER
UNITS / MM
LOADTL / 1, OSETNO, 1
$$-> CUTTER / 12.000000
$$-> CSYS / 1.0000000000, 0.0000000000, 0.0000000000, 10.0000000000, $
           0.0000000000, 1.0000000000, 0.0000000000, 20.0000000000, $
           0.0000000000, 0.0000000000, 1.0000000000, -1500.0000000000
MULTAX / ON
SPINDL / RPM, 1000.000000,  CLW
RAPID
GOTO / -20.0000000000, -10.0000000000, 100.0000000000, $
 0.0000000000, 0.0000000000, 1.0000000000
FEDRAT / 20.000000,  MMPM
GOTO / -20.0000000000, -10.0000000000, -2.0000000000, $
 0.0000000000, 0.0000000000, 1.0000000000
CIRCLE / 0.0, -10.0, -2.0, 0.0000000000, 0.0000000000, 1.0000000000, 20.0
GOTO / 20.0000000000, -10.0000000000, -2.0
SPINDL / OFF
$$-> END /
FINI
"""
NX_HEADER = "TOOL PATH/A,TOOL,T\nTLDATA/MILL,10.0,0.0,75.0,0.0,0.0\nMSYS/0,0,0,1,0,0,0,1,0\n"
SOLIDWORKS = """\
PARTNO/1
UNIT/INCH
LOAD/TOOL,5
SPINDL/3000,RPM,CLW
RAPID/
GOTO/1.0,2.0,1.0
CYCLE/DEEP,FEDTO,0.5,INCR,0.2,IPM,10.,RAPTO,0.1,INIT
GOTO/1.0,2.0,0
CYCLE/OFF
FINI
"""
AUTODESK = """\
MODE/MILL
PARTNO/'T'
UNITS/MM
MULTAX/ON
LOADTL/1, 0, 50.0, 1
SPINDL/8000, RPM, CLW
RAPID
GOTO/20, 0, 10, 0, 0, 1
FEDRAT/400, MMPM
GOTO/20, 0, -2, 0, 0, 1
MOVARC/0, 0, -2, 0, 0, 1, 20, ANGLE, 180
GOTO/-20, 0, -2
RAPID
GOTO/20, 0, 10
END
FINI
"""
CATIA = """\
$$     CATIA APT VERSION 1.0
$$*CATIA0
$$ Part Operation.1
$$     1.00000     0.00000     0.00000     0.00000
$$     0.00000     1.00000     0.00000     0.00000
$$     0.00000     0.00000     1.00000     5.00000
PARTNO PART
FEDRAT/ 1000.0000,MMPM
GOTO  /   20.00000,    0.00000,    0.00000
INDIRV/   0.00000,   1.00000,   0.00000
TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    0.00000,$
    20.00000),ON,2,INTOF,$
 (LINE/    0.00000,    0.00000,    0.00000,$
         20.00000,    0.00000,    0.00000)
FINI
"""
MASTERCAM = """\
$$ MASTERCAM X9
UNITS/MM
FEDRAT/300,MMPM
GOTO/-5,-10,0
GOTO/0,-10,0
CIRCLE/0,0,0,0,0,1,10
GOTO/10,0,0
FINI
"""
NX = NX_HEADER + "RAPID\nGOTO/0,20,0\nFEDRAT/MMPM,250\nCIRCLE/0,0,0,0,0,1,20,.06,.5,10,0\nGOTO/20,0,0\nEND-OF-PATH\n"
FILES = {
    "creo": CREO_CSYS,
    "solidworks": SOLIDWORKS,
    "autodesk": AUTODESK,
    "catia": CATIA,
    "mastercam": MASTERCAM,
    "nx": NX,
    "apt": "PARTNO/1\nFEDRAT/100,MMPM\nGOTO/0,0,0\n",
}


@pytest.fixture
def read(tmp_path):
    def reads(text, **options):
        path = tmp_path / "part.cl"
        path.write_text(text)
        return read_cl(path, **options)

    return reads


def refused(read, text, line, *words):
    with pytest.raises(InputError) as caught:
        read(text)
    message = str(caught.value)
    assert "\n" not in message and caught.value.line == line, message
    for word in words:
        assert word in message, message


def turn_about(points, centre=(0.0, 0.0)):
    """The angle that points in the plane XY go round a centre, in degrees."""
    angle = np.unwrap(np.arctan2(points[:, 1] - centre[1], points[:, 0] - centre[0]))
    return math.degrees(angle[-1] - angle[0])


def holes(path):
    """Each motion of a path as height, rapid and feed."""
    return [(z, bool(r), f) for z, r, f in zip(path.tip[:, 2], path.rapid, path.feed, strict=True)]


# headers


@pytest.mark.parametrize(("name", "text"), FILES.items())
def test_dialects_are_told_and_named(read, name, text):
    path = read(text)
    assert path.dialect == name
    named = [n.text for n in path.notes if n.text.startswith("read as")]
    assert named == ([] if name == "apt" else [f"read as {DIALECTS[name].title} writes it"])


def test_a_word_tells_more_than_a_comment(read):
    assert read("$$ made after SOLIDWORKS\n" + NX).dialect == "nx"
    assert read("FEDRAT/5\nGOTO/0,0,0\n$$ MASTERCAM\nGOTO/1,0,0\n").dialect == "apt"


@pytest.mark.parametrize("text", FILES.values())
def test_the_format_is_detected(tmp_path, text):
    (tmp_path / "part").write_text(text)
    assert detect_format(tmp_path / "part") == "cl"
    assert len(read_path(tmp_path / "part", frame="ignore"))


# arcs

QUARTER = "GOTO / 0.0, 20.0, 10.0\nCIRCLE / 0.0, 0.0, 10.0,  $\n0.0, 0.0, {sign}1.0,  20.0\nGOTO / 20.0, 0.0, 10.0\n"
LEAVE = "GOTO / 20.0, -40.0, 10.0\n"
START = "FEDRAT / 500.0,  MMPM\nRAPID\nGOTO / 0.0, 20.0, 30.0\n"


@pytest.mark.parametrize(
    ("header", "sign"),
    [(CREO_HEADER, "-"), ("UNIT/MM\n", "-"), ("$$ SolidWorks CAM\n", "-"), (NX_HEADER, ""), ("", ""), ("", "-")],
)
def test_a_quarter_clockwise(read, header, sign):
    """PTC's and SolidWorks' axis is right-handed, NX's left-handed; without a header the line after the arc decides."""
    path = read(header + START + QUARTER.format(sign=sign) + LEAVE)
    arc = path.tip[1:-1]
    assert turn_about(arc) == pytest.approx(-90.0, abs=1e-9)
    np.testing.assert_allclose(np.hypot(arc[:, 0], arc[:, 1]), 20.0, atol=1e-9)
    np.testing.assert_allclose(path.tip[-1], [20, -40, 10], atol=1e-12)
    assert set(path.feed[1:]) == {500.0} and not path.rapid[1:].any()


def test_a_feed_between_an_arc_and_its_proof_is_not_the_arcs(read):
    path = read(START + QUARTER.format(sign="") + "FEDRAT/77\n" + LEAVE)
    assert set(path.feed[1:-1]) == {500.0} and path.feed[-1] == 77.0
    assert turn_about(path.tip[1:-1]) == pytest.approx(-90.0, abs=1e-9)


def test_the_motion_before_proves_an_arc(read):
    for sign in ("", "-"):
        text = (
            f"FEDRAT/9\nGOTO/-9,20,10\nGOTO/0,20,10\nCIRCLE/0,0,10,0,0,{sign}1,20\nGOTO/20,0,10\nRAPID\nGOTO/20,0,50\n"
        )
        assert turn_about(read(text).tip[1:-1]) == pytest.approx(-90.0, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (START + QUARTER.format(sign=""), 5),  # nothing tells or proves it
        (START + QUARTER.format(sign="") + "GOTO/40,40,10\n", 5),
        (START + QUARTER.format(sign="") + "RAPID\n" + LEAVE, 5),
        (CREO_HEADER + START + QUARTER.format(sign="") + LEAVE, 6),  # the header's hand contradicts the line after it
        (NX_HEADER + START + QUARTER.format(sign="-") + LEAVE, 8),
        ("FEDRAT/9\nGOTO/9,20,10\n" + QUARTER.format(sign="") + LEAVE, 4),  # the neighbours contradict each other
    ],
)
def test_arcs_that_nothing_proves_are_refused(read, text, line):
    refused(read, text, line, "way round")


@pytest.mark.parametrize("seed", range(30))
def test_tangential_arcs_go_round_as_they_are_joined(read, seed):
    """Random line, arc, line in space, joined tangentially: the same way round in each dialect and without a header."""
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    u, v, normal = basis[:, 0], basis[:, 1], np.cross(basis[:, 0], basis[:, 1])
    centre, radius, turn = rng.normal(size=3) * 50, rng.uniform(1, 50), rng.uniform(0.2, 6.0)

    def at(angle):
        return centre + radius * (math.cos(angle) * u + math.sin(angle) * v)

    def along(angle):
        return -math.sin(angle) * u + math.cos(angle) * v

    points = [at(0) - 5 * along(0), at(0), at(turn), at(turn) + 5 * along(turn)]
    text = ["GOTO/" + ",".join(f"{c:.7f}" for c in p) for p in points]
    for header, hand in ((CREO_HEADER, 1), ("UNIT/MM\n", 1), (NX_HEADER, -1), ("", 1), ("", -1)):
        circle = "CIRCLE/" + ",".join(f"{c:.9f}" for c in (*centre, *(hand * normal), radius))
        path = read(header + "FEDRAT/9\n" + "\n".join([*text[:2], circle, *text[2:]]) + "\n")
        local = (path.tip[1:-1] - centre) @ np.column_stack([u, v])
        assert turn_about(local) == pytest.approx(math.degrees(turn), abs=1e-3)


def test_points_on_an_arc(read):
    """PTC Creo writes several points on one arc: it goes on along the circle through all of them."""
    at = [(20 * math.cos(a), 20 * math.sin(a)) for a in np.radians([0, 60, 120, 180])]
    text = "FEDRAT/9\nGOTO/20,0,0\nCIRCLE/0,0,0,0,0,1,20\n" + "".join(f"GOTO/{x:.6f},{y:.6f},0\n" for x, y in at[1:])
    path = read(CREO_HEADER + text + "GOTO/-20,-30,0\n")
    arc = path.tip[:-1]
    np.testing.assert_allclose(np.hypot(arc[:, 0], arc[:, 1]), 20.0, atol=1e-5)
    assert turn_about(arc) == pytest.approx(180.0, abs=1e-5)
    middles = (arc[1:] + arc[:-1]) / 2
    assert (20.0 - np.hypot(middles[:, 0], middles[:, 1])).max() < 0.0101
    refused(read, CREO_HEADER + text + "GOTO/20,0,0\n", 8, "may end a line")
    # a rapid motion, or another statement between, ends the arc
    assert turn_about(read(CREO_HEADER + text + "RAPID\nGOTO/20,0,0\n").tip[:-1]) == pytest.approx(180.0, abs=1e-5)
    assert len(read(CREO_HEADER + text + "FEDRAT/8\nGOTO/20,0,0\n")) == len(arc) + 1


def test_a_short_arc_may_turn_back_where_another_one_proves_the_dialect(read):
    """The corner that a smaller tool cleans: out along its fillet, back along the larger tool's (SolidWorks CAM)."""
    fillet = "GOTO/0,9.25,0\nGOTO/0,8,0\nCIRCLE/.75,8,0,0,0,1\nGOTO/0.75,7.25,0\nGOTO/3,7.25,0\n"
    corner = "RAPID\nGOTO/0,2.5,0\nGOTO/0,0,0\nCIRCLE/3.25,0,0,0,0,-1\nGOTO/3.25,3.25,0\nGOTO/.75,3.25,0\n"
    head = "$$ SOLID WORKS\nFEDRAT/9\n"
    path = read(head + fillet + corner)
    assert -90 < turn_about(path.tip[path.line == 11], (3.25, 0)) < -60
    assert [note.line for note in path.notes if "turns back" in note.text] == [11]
    refused(read, head + corner, 6, "contradicts")
    long_way = corner.replace("0,0,-1", "0,0,1").replace("0,2.5", "0,-2.5").replace(".75,3", "5,3")
    refused(read, head + fillet + long_way, 11, "contradicts")


def test_a_circle_without_its_radius(read):
    text = "UNIT/{}\nFEDRAT/9\nGOTO/3,-4,1\nCIRCLE/0,0,1,0,0,-1.\nGOTO/-5,0,1\n"
    for unit, mm in (("MM", 1.0), ("INCH", 25.4)):
        path = read(text.format(unit))
        np.testing.assert_allclose(np.hypot(path.tip[:, 0], path.tip[:, 1]), 5.0 * mm)
        assert turn_about(path.tip) == pytest.approx(-math.degrees(math.acos(-0.6)))
    refused(read, "UNIT/MM\nFEDRAT/9\nCIRCLE/0,0,1,0,0,-1.\nGOTO/-5,0,1\n", 3, "start")


@pytest.mark.parametrize(
    ("axis", "angle", "end", "expected"),
    [
        (1, 180, (-20, 0), 180),
        (-1, 180, (-20, 0), -180),
        (1, 90, (0, 20), 90),
        (-1, 270, (0, 20), -270),
        (-1, 90, (0, 20), 90),  # older post processors state the axis the other way: the angle proves it
        (1, 360, (20, 0), 360),
        (1, 450, (0, 20), 450),
    ],
)
def test_movarc(read, axis, angle, end, expected):
    text = f"UNITS/MM\nFEDRAT/400,MMPM\nGOTO/20,0,-2\nMOVARC/0, 0, -2, 0, 0, {axis}, 20, ANGLE, {angle}\n"
    path = read(text + f"GOTO/{end[0]},{end[1]},-2\n")
    assert turn_about(path.tip) == pytest.approx(expected, abs=1e-9)
    refused(read, text + "GOTO/19.5,4.4440972,-2\n", 5, "degrees")


def test_movarc_without_an_angle_is_right_handed(read):
    text = "FEDRAT/9\nGOTO/20,0,0\nMOVARC/ CENTER, 0,0,0, AXIS, 0,0,1, RADIUS, 20\nGOTO/0,20,0\n"
    assert turn_about(read(text).tip) == pytest.approx(90.0)


def test_nx_times(read):
    text = NX_HEADER + "FEDRAT/9\nGOTO/10,0,0\nCIRCLE/0,0,0,0,0,-1,10,.1,.5,0,0,TIMES,{}\nGOTO/{},-6\n"
    path = read(text.format(3, "10,0"))
    assert turn_about(path.tip) == pytest.approx(1080.0)
    np.testing.assert_allclose(path.tip[:, 2], np.linspace(0, -6, len(path)), atol=1e-9)
    assert turn_about(read(text.format(2.25, "0,10")).tip) == pytest.approx(810.0)
    refused(read, text.format(2, "0,10"), 7, "TIMES")
    refused(read, text.format("1e9", "10,0"), 6, "turns")


# words that move, turn, shift or compensate


@pytest.mark.parametrize(
    "statement",
    [
        *REFUSED,
        *("GOTOO/1,2,3", "GOT0/1,2,3", "GOHOME", "GOSOMEWHERE", "L1)GOTO/1,2,3", "N10 GOTO/1,2,3"),
        *("MODE/INCR", "MODE/TURN", "CUTCOM/LEFT", "CUTCOM/ON,RIGHT,3", "TRANS/1,2,3", "TRACUT/LT1", "CSYS/1,2"),
        *("RAPDI", "FEDRATE/5", "SPINDLE/3", "ORIGN/1,2,3", "CYCL/OFF", "UNTS/MM", "MSY/0,0,0,1,0,0,0,1,0"),
        *("TLON,GOLFT/L1", "GOFWD/C1,PAST,L2", "GOLFT/L1", "TLLFT,GOLFT/L1", "COPY/1,TRANSL,10,0,0,1"),
        *("CALL/SUB1", "ROTABL/90", "M1=MACRO/A", "L1)LOOPST"),
        *("RAPID/OFF", "RAPID/ON", "RAPID,GOTO/1,2,3", "MULTAX,GOTO/1,2,3", "FEDRAT,9/GOTO/1,2,3", "COOLNT,ON"),
        *("G0 X5", "N10 G01X5.Y-.5", "X1Y2", "M30", "LOADTL/-1", "LOADTL/1.5", "CUTTER/-5"),
        *("GOTO/1,2,3$\n4", "GOTO/1  2,3,4", "GOTO/1,2,3      00010", "GOTO/1,2, 3\t\t4", "FEDRAT/1   5"),
    ],
)
def test_refused_with_the_line(read, statement):
    refused(read, f"FEDRAT/5\nGOTO/0,0,0\n{statement}\nGOTO/1,0,0\n", 3)


def test_what_takes_modes_off_is_read(read):
    path = read(
        "MODE/MILL\nCUTCOM/OFF\nTRACUT/NOMORE\nTRANS/NOMORE\nCUTCOM/ON,LENGTH,1\nFEDRAT/5\nGOTO/0,0,0\nGOTO/1,0,0\n"
    )
    assert len(path) == 2 and path.notes == ()


def test_compensation_that_is_in_the_path(read):
    start = "$$-> CUTCOM_GEOMETRY_TYPE / {}\nFEDRAT/5\nGOTO/0,0,0\nCUTCOM/LEFT\nGOTO/1,0,0\n"
    assert any("already in the path" in n.text for n in read(start.format("OUTPUT_ON_CENTER")).notes)
    refused(read, start.format("OUTPUT_ON_CONTOUR"), 4, "compensation")


def test_words_that_inform_are_listed_once(read):
    path = read("FEATNO/1\nCLRSRF/3\nGOTO/0,0,0\n" + "FEATNO/2\nSEQNO/3\n" * 50 + "WHATEVER/1\n")
    assert [n.text for n in path.notes] == [
        "words that only inform: CLRSRF, FEATNO, SEQNO",
        "unknown word 'WHATEVER', not acted on",
    ]


def test_the_tables_of_words_do_not_overlap():
    assert not set(REFUSED) & set(WORDS) and not INFORMING & set(WORDS) and not INFORMING & set(REFUSED)


def test_gohome_is_a_rapid_motion(read):
    path = read(NX_HEADER + "FEDRAT/9\nGOTO/30,0,-25\nGOHOME/0,0,120\nGOTO/1,0,120\n")
    np.testing.assert_array_equal(path.tip, [[30, 0, -25], [0, 0, 120], [1, 0, 120]])
    assert path.rapid.tolist() == [False, True, False]


WORK_PLANE = "MCS/1,0,0,$\n0,0,1,$\n0,-1,0,$\n10,20,30\n"  # directions of X, Y and Z, then the origin: Autodesk's posts


def test_the_work_plane_of_an_operation_is_its_frame(read):
    path = read("UNITS/MM\n" + WORK_PLANE + "MCS2/1,0,0,0,0,1,0,-1,0\nFEDRAT/9\nGOTO/1,2,3\n")
    np.testing.assert_array_equal(path.frame, [[1, 0, 0, 10], [0, 0, -1, 20], [0, 1, 0, 30]])
    assert path.dialect == "camplete"
    # the same point, told in the machine's directions first and in the work plane's then
    path = read("MCS/1,0,0,0,1,0,0,0,1,0,0,0\nFEDRAT/9\nGOTO/11,17,32\n" + WORK_PLANE + "GOTO/1,2,3\n")
    np.testing.assert_allclose(path.tip, [[11, 17, 32]] * 2, atol=1e-12)
    np.testing.assert_allclose(path.axis, [[0, 0, 1], [0, -1, 0]], atol=1e-12)
    refused(read, "MCS2/1,0,0,0,0,1,0,-1,0\nRAPID\nGOTO/1,2,3\n", 1, "MCS")


def test_circles_of_autodesks_post_for_camplete(read):
    # its onCircular: the plane's normal for a clockwise arc, the other way for a counterclockwise one
    start = "CSI_TOOL_PATH/A\nFEDRAT/9\nGOTO/20,0,0\nCIRCLE/0,0,0,0,0,{},20,90,0,0,0\nGOTO/0,{},0\n"
    for normal, end in ((-1, 20), (1, -20)):
        path = read(start.format(normal, end))
        angles = np.unwrap(np.arctan2(path.tip[:, 1], path.tip[:, 0]))
        assert np.degrees(angles[-1]) == pytest.approx(-90 * normal)


@pytest.mark.parametrize(
    ("header", "word", "data"),
    [
        ("UNIT/MM\n", "LOADTL/5,125.", {"number": 5.0, "set_length": 125.0}),
        ("UNIT/INCH\n", "LOADTL/5,5.", {"number": 5.0, "set_length": 127.0}),
        ("$$ AUTODESK\n", "LOADTL/5, 0, 50.0, 5", {"number": 5.0, "body_length": 50.0}),
        ("$$ AUTODESK\n", "LOADTL/5, IN, 0, LENGTH, 50.0, OSETNO, 5", {"number": 5.0, "body_length": 50.0}),
        ("$$ CATIA APT VERSION 1.0\n", "LOADTL/5,1,1", {"number": 5.0}),
        (NX_HEADER, "LOAD/TOOL,5,ADJUST,7", {"number": 5.0}),
        ("", "TLDATA/DRILL,MILL,8.,0.,80.,118.,35.",
         {"type": "DRILL,MILL", "diameter": 8.0, "corner_radius": 0.0, "length": 80.0}),
    ],
)  # fmt: skip
def test_lengths_by_position(read, header, word, data):
    path = read(f"{header}{word}\nFEDRAT/9\nGOTO/0,0,0\n")
    assert data.items() <= path.tool.items() and not {"set_length", "body_length"} & (path.tool.keys() - data.keys())
    assert not any("behind the tool's number" in note.text for note in path.notes)


def test_values_behind_the_tools_number_that_no_header_tells(read):
    path = read("LOADTL/5,125\nFEDRAT/9\nGOTO/0,0,0\n")
    assert path.tool == {"number": 5.0} and [(n.line, n.text[:30]) for n in path.notes] == [
        (1, "values behind the tool's numbe")
    ]


def test_a_tool_with_a_body_and_a_cutter_stays_the_same_tool(read):
    tool = "CUTTER/10,0,5,0,0,0,30\nLOADTL/1,0,50,1\nSPINDL/900,RPM\n"
    path = read("$$ AUTODESK\nFEDRAT/9\n" + tool + "GOTO/0,0,0\n" + tool + "GOTO/1,0,0\n")
    assert len(path.tools) == 1 and not path.tools[0].changed


@pytest.mark.parametrize(
    "statement",
    [
        "SET/MODE,INCR",
        "NURBS/KNOT,0,0,1,1",
        "MOVETO/1,2,3",
        "PLUNGE/5",
        "THICK/2",
        "ZSURF/3",
        "COUPLE/AUTO",
        "ZERO/2",
        "FIXTUR/2",
        "TLCOMP/ON,LEFT",
        "WPLANE/XYPLAN",
        "CALLSUB/1001",
        "TRANSFORM/XY",
        "CYCLE83/10,0,2,-50,0,0,0,5,0.5,0,0.5,1,0,0",
    ],
)
def test_other_words_that_move_or_shift_are_refused(read, statement):
    refused(read, f"ZERO/1\nFIXTUR/1\nFEDRAT/9\nGOTO/0,0,0\n{statement}\nGOTO/1,0,0\n", 5, statement.partition("/")[0])


def test_settings_that_change_nothing(read):
    path = read(
        "ZERO/1\nSET/MODE,ABSOL\nSET/ADJUST,1\nSELECTL/3\nFIXTUR/2\nFEDRAT/9\nGOTO/0,0,0\nZERO/1\nFIXTUR/2\nGOTO/1,0,0\n"
    )
    assert len(path) == 2 and [note.text for note in path.notes] == ["words that only inform: SET"]


TILTED = "FEDRAT/9\nMULTAX/ON\nGOTO/0,0,0,0.6,0,0.8\nMULTAX/OFF\n"


def test_a_tilted_axis_is_not_carried_on_after_multax_off(read):
    for motion in ("GOTO/1,0,0\n", "RAPID\nGOTO/1,0,0\n", "GODLTA/1,0,0\n", "FROM/1,0,0\n"):
        refused(read, TILTED + motion, TILTED.count("\n") + motion.count("\n"), "MULTAX/OFF")
    refused(read, TILTED + "CYCLE/DRILL,DEPTH,5,CLEAR,2\nGOTO/1,0,0\n", 6, "MULTAX/OFF")
    for words in ("TLAXIS/0,0,1\nGOTO/1,0,0\n", "GOTO/1,0,0,0,0,1\n", "TOOL PATH/B,TOOL,T\nGOTO/1,0,0\n"):
        assert read(TILTED + words).axis.tolist() == [[0.6, 0, 0.8], [0, 0, 1]]
    assert read(TILTED + "MULTAX/ON\nGOTO/1,0,0\n").axis[1].tolist() == [0.6, 0, 0.8]
    assert len(read("MULTAX/OFF\nFEDRAT/9\nGOTO/0,0,0\nGOTO/1,0,0\n")) == 2
    # sequences of three axes of these systems are along Z
    for header in (CREO_HEADER, "PPRINT/'AUTODESK'\n"):
        assert read(header + TILTED + "GOTO/1,0,0\n").axis.tolist() == [[0.6, 0, 0.8], [0, 0, 1]]


# units and feeds


def test_units_behind_the_tool_hold_for_it_too(read):
    tool = "CUTTER/.5,.1\nLOADTL/1,LENGTH,5\n"
    for text in (tool + "UNITS/INCHES\n", "UNITS/INCHES\n" + tool, tool + "UNITS/MM\nUNITS/INCHES\n"):
        path = read(text + "FEDRAT/9\nGOTO/0,0,0\n")
        sizes = {"diameter": 12.7, "corner_radius": 2.54, "number": 1.0, "set_length": 127.0}
        assert path.tool == pytest.approx(sizes) and path.tools[0].data == pytest.approx(sizes)


@pytest.mark.parametrize(("unit", "scale"), [("INCH", 25.4), ("MM", 1.0)])
def test_unit(read, unit, scale):
    path = read(f"UNIT/{unit}\nRAPID/\nGOTO/1,2,1\nFEDRAT/10.,IPM\nGOTO/1,2,-0.5\n")
    np.testing.assert_allclose(path.tip, np.array([[1, 2, 1], [1, 2, -0.5]]) * scale, rtol=1e-15)
    assert path.feed[1] == 254.0


@pytest.mark.parametrize("speed", ["FEDRAT/10,IPM", "SPINDL/SFM,300,CLW", "CYCLE/DRILL,DEPTH,1,CLEAR,1,IPM,3"])
def test_inches_are_stated(read, speed):
    start, cut = f"CUTTER/10\nFEDRAT/9\n{speed}\nCYCLE/OFF\n", "GOTO/0,0,0\nGOTO/1,0,0\n"
    for text in (start + cut, start + cut + "UNITS/INCHES\n", start.replace(speed, "GOTO/0,0,0\n" + speed) + cut):
        refused(read, text, 1 + text[: text.index(speed)].count("\n"), "unit of length")
    for text in (start + "UNITS/INCHES\n" + cut, "UNITS/INCHES\n" + start + cut):
        path = read(text)
        assert path.tip[-1, 0] == 25.4 and path.units == "inch"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("GOTO/0,0,0\nGOTO/1,0,0\n", 2),
        ("SPINDL/RPM,4000,CLW\nRAPID\nGOTO/0,0,20\nGOTO/0,0,-2\n", 4),
        ("FEDRAT/0.2,MMPR\nGOTO/0,0,0\nGOTO/1,0,0\n", 3),
        (CREO_HEADER + "GOTO/0,20,0\nCIRCLE/0,0,0,0,0,1,20\nGOTO/20,0,0\n", 4),
        ("GOTO/0,0,9\nCYCLE/DRILL,DEPTH,5,CLEAR,2\nGOTO/0,0,0\n", 3),
        ("CYCLE/DRILL,DEPTH,5,CLEAR,2\nGOTO/0,0,0\n", 2),
        ("GOTO/0,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/5,0,0,5),ON,2,INTOF,(LINE/5,0,0,5,5,0)\n", 3),
        ("FROM/0,0,0\nGODLTA/1,0,0\n", 2),
    ],
)
def test_no_feed_is_no_cut(read, text, line):
    refused(read, text, line, "feed")


@pytest.mark.parametrize("feed", ["FEDRAT/0,MMPM", "SPINDL/OFF\nFEDRAT/0.2,MMPR", "SPINDL/0,RPM\nFEDRAT/1,IPR"])
def test_a_feed_of_zero_is_no_cut(read, feed):
    refused(read, feed + "\nRAPID\nGOTO/0,0,0\nGOTO/1,0,0\n", feed.count("\n") + 4, "feed of zero")


def test_no_feed_in_a_large_file(tmp_path):
    path = tmp_path / "big.cl"
    for start, line in (("", 2), ("RAPID\n", 3), ("FROM/0,0,0\nRAPID\n", 4), ("FEDRAT/1,MMPR\n", 3), ("FEDRAT/0\n", 3)):
        path.write_text(start + "GOTO/1,2,3\n" * 60_000)
        with pytest.raises(InputError, match=rf":{line}: GOTO: .*feed"):
            read_cl(path)
    path.write_text("RAPID\n" + "GOTO/1,2,3\nRAPID\n" * 60_000)
    assert read_cl(path).rapid.all()


def test_feed_per_revolution(read):
    path = read("FEDRAT/0.2,MMPR\nSPINDL/1000,RPM\nGOTO/0,0,0\nGOTO/1,0,0\n")
    assert path.feed.tolist() == [200.0, 200.0]


# cycles

TOP = "SPINDL/RPM,1200,CLW\nRAPID\nGOTO/0,0,50\n{}\nGOTO/0,0,0\nCYCLE/OFF\nRAPID\nGOTO/0,0,50\n"
NAN = float("nan")
CAMPLETE = "CSI_TOOL_PATH/A\n"


@pytest.mark.parametrize(
    ("header", "cycle"),
    [
        (CREO_HEADER, "CYCLE / DRILL, DEPTH, 20.0, MMPM, 100.0, CLEAR, 3.0"),
        ("MACHIN / UNCX01, 1\n", "CYCLE / DRILL, DEPTH, 20.0, MMPM, 100.0, CLEAR, 3.0"),
        ("", "CYCLE/DRILL,DEPTH,20,PERMIN,100,CLEAR,3,RETURN,3"),
        ("UNIT/MM\n", "CYCLE/DRILL,FEDTO,20.,MMPM,100.,RAPTO,3."),
        (NX_HEADER, "CYCLE/DRILL,RAPTO,3,FEDTO,-20,RTRCTO,3,MMPM,100"),
        (NX_HEADER, "CYCLE/CSINK,RAPTO,3,FEDTO,-20,MMPM,100"),
        (NX_HEADER, "CYCLE/DRILL,RAPTO,3,CLEAR,3,FEDTO,-20,MMPM,100"),
    ],
)
def test_the_depth_is_the_dialects(read, header, cycle):
    path = read(header + TOP.format(cycle))
    heights = path.tip[:, 2].tolist()
    assert heights == [50, 50, 3, -20, 3, 50]
    assert path.rapid.tolist() == [True, True, True, False, True, True] and path.feed[3] == 100.0


@pytest.mark.parametrize(
    ("header", "cycle", "heights"),
    [
        # PTC: RAPTO is a further rapid advance, from CLEAR towards the point
        (CREO_HEADER, "CYCLE / DRILL, DEPTH, 20, MMPM, 100, CLEAR, 5, RAPTO, 2", [3, -20, 5]),
        (CREO_HEADER, "CYCLE / DRILL, DEPTH, 20, MMPM, 100, CLEAR, 5, RAPTO, 2, RETURN, 9", [3, -20, 9]),
        # PTC: RETURN of 0 is the retract plane, from which the tool comes
        (CREO_HEADER, "CYCLE / DRILL, DEPTH, 20, MMPM, 100, CLEAR, 3, RETURN, 0", [3, -20, 50]),
        # Autodesk's post: clearance 55, retract plane 43, stock 40
        (CAMPLETE, "CYCLE/DRILL, FEDTO, 20, MMPM, 100, CLEAR, 55, RTRCTO, 15, RETURN, 15, RAPTO, 3", [3, -20, 15]),
        (CAMPLETE, "CYCLE/DRILL, FEDTO, 20, MMPM, 100, CLEAR, 55, RTRCTO,15", [15, -20, 15]),
    ],
)
def test_clearances_are_the_dialects(read, header, cycle, heights):
    assert read(header + TOP.format(cycle)).tip[2:-1, 2].tolist() == heights


@pytest.mark.parametrize(("cycle", "back"), [("RETURN,30", 30), ("INIT", 50), ("RTRCTO,AUTO", 50), ("RTRCTO,25.", 25)])
def test_where_the_tool_returns(read, cycle, back):
    path = read(TOP.format(f"CYCLE/DRILL,DEPTH,20,CLEAR,3,MMPM,100,{cycle}"))
    assert path.tip[:, 2].tolist()[2:5] == [3, -20, back]


@pytest.mark.parametrize(
    ("cycle", "heights"),
    [
        ("DEEP", [3, -8, 3, -7.746, -16, 3, -15.746, -20, 3]),
        ("BRKCHP", [3, -8, -7.746, -16, -15.746, -20, 3]),
        ("DRILL,DEEP", [3, -8, 3, -7.746, -16, 3, -15.746, -20, 3]),
        ("DRILL,BRKCHP", [3, -8, -7.746, -16, -15.746, -20, 3]),
    ],
)
def test_pecks(read, cycle, heights):
    for word in ("STEP", "INCR"):
        path = read(TOP.format(f"CYCLE/{cycle},DEPTH,20,{word},8,CLEAR,3,MMPM,100"))
        np.testing.assert_allclose(path.tip[2:-1, 2], heights, atol=1e-12)
        down = np.diff(path.tip[1:-1, 2]) < 0
        below = path.tip[2:-1, 2] < path.tip[1:-2, 2].clip(max=3)
        # whatever goes deeper than before is fed
        deepest = np.minimum.accumulate(path.tip[:-1, 2])
        deeper = np.r_[False, deepest[1:] < deepest[:-1] - 1e-9] & (path.tip[:-1, 2] < 3)
        assert not path.rapid[:-1][deeper].any() and down.any() and below.any()


def test_solidworks_pecks_in_inches(read):
    path = read(SOLIDWORKS)
    expected = [1, 1, 0.1, -0.2, 0.1, -0.19, -0.4, 0.1, -0.39, -0.5, 1]
    np.testing.assert_allclose(path.tip[:, 2] / 25.4, expected, atol=1e-12)


def test_solidworks_first_pecks_and_initial_height(read):
    cycle = "CYCLE/DEEP2,FEDTO,9,1STPECK,5,SUBPECK,2,MMPM,60,RAPTO,3{}"
    text = f"UNIT/MM\nRAPID\nGOTO/0,0,25\nCYCLE/INIT\n{cycle}\nGOTO/0,0,-1\n"
    for back, out in (("", 25.0), (",RTRCTO,10", 9.0)):
        path = read(text.format(back))
        assert path.tip[~path.rapid, 2].tolist() == [-6.0, -8.0, -10.0] and path.tip[-1, 2] == out
    refused(read, text.format(",MINPECK,1"), 5, "MINPECK")


def test_bore_and_ream_are_fed_out(read):
    for word in ("BORE", "REAM", "BORE,DRAG"):
        path = read(TOP.format(f"CYCLE/{word},DEPTH,20,CLEAR,3,MMPM,100,RETURN,30"))
        assert holes(path)[3:5] == [(-20, False, 100), (3, False, 100)]
        assert path.tip[5, 2] == 30 and path.rapid[5]


def test_tap_turns_the_spindle_back(read):
    path = read(TOP.format("CYCLE/TAP,DEPTH,20,CLEAR,3,MMPR,1.5"))
    assert [(z, r) for z, r, _ in holes(path)][2:5] == [(3, True), (-20, False), (3, False)]
    assert path.feed[3:5].tolist() == [1800.0, 1800.0]
    spindle = [(e.record, e.text) for e in path.events if e.line == 5]
    assert spindle == [(4, "SPINDL/RPM,1200,CCLW"), (5, "SPINDL/RPM,1200,CLW")]
    assert any("floating holder" in n.text for n in path.notes)
    refused(read, "GOTO/0,0,9\nCYCLE/TAP,DEPTH,20,CLEAR,3,MMPM,100\nGOTO/0,0,0\n", 3, "spindle")


def test_dwell(read):
    for dwell, seconds in (("DWELL,0.5", 0.5), ("DWELL,REV,10", 0.5), ("DWELL,10,REV", 0.5)):
        path = read(TOP.format(f"CYCLE/DRILL,DEPTH,20,CLEAR,3,MMPM,100,{dwell}"))
        assert [(e.record, e.text) for e in path.events if e.line == 5] == [(4, f"DELAY/{seconds:.6f}")]


@pytest.mark.parametrize(
    ("header", "cycle"),
    [
        ("", "CYCLE/DRILL,FEDTO,2.,MMPM,120.,RAPTO,3.,RTRCTO,25."),
        (NX_HEADER, "CYCLE/DRILL,FEDTO,2.,MMPM,120.,RAPTO,3."),
        ("UNIT/MM\n", "CYCLE/DRILL,FEDTO,-2.,MMPM,120.,RAPTO,3."),
        (CREO_HEADER, "CYCLE/DRILL,DEPTH,-20,CLEAR,3"),
        ("$$ CATIA APT VERSION 1.0\n", "CYCLE/DRILL,  10.000000,   5.000000, 500.000000,MMPM"),
        ("MOVARC", "CYCLE/DRILL, 10.0, MMPM, 300.0, 15.0, RAPTO, 10.0"),
        ("", "CYCLE/DEEP,DEPTH,20,CLEAR,3"),
        ("", "CYCLE/DEEP,DEPTH,20,CLEAR,3,STEP,0.001"),
        ("", "CYCLE/DRILL,DEPTH,20,FEDTO,-20,CLEAR,3"),
        ("", "CYCLE/DRILL,DEPTH,20"),
        ("", "CYCLE/DRILL,DEPTH,20,CLEAR,3,MMPM,100,IPM,5"),
        ("", "CYCLE/DRILL,DEPTH,20,CLEAR,3,INIT,RETURN,9"),
        ("", "CYCLE/BORE,DEPTH,20,CLEAR,3,ORIENT,90"),
        ("", "CYCLE/BORE,NODRAG,DEPTH,20,CLEAR,3"),
        ("", "CYCLE/THREAD,DEPTH,20,CLEAR,3"),
        ("", "CYCLE/DRILL,DEPTH,20,CLEAR,5,RAPTO,2"),
        ("", "CYCLE/DRILL,DEPTH,20,CLEAR,5,RETURN,0"),
        (CREO_HEADER, "CYCLE / DRILL, 20.0, 100.0, MMPM, 3.0"),
        (CAMPLETE, "CYCLE/REAM, FEDTO, 20, MMPM, 100, CLEAR, 55, RAPTO, 12"),
    ],
)
def test_cycles_refused(read, header, cycle):
    header = header if header != "MOVARC" else "$$ AUTODESK\n"
    refused(read, header + TOP.format(cycle), header.count("\n") + 4, "CYCLE")


# frames


def test_creo_frame(read):
    path = read(CREO_CSYS)
    np.testing.assert_array_equal(path.frame, [[1, 0, 0, 10], [0, 1, 0, 20], [0, 0, 1, -1500]])
    assert path.tool["diameter"] == 12.0 and path.line[0] == 16
    arc = path.tip[1:]
    np.testing.assert_allclose(np.hypot(arc[:, 0], arc[:, 1] + 10), 20.0, atol=1e-9)
    assert turn_about(arc, (0, -10)) == pytest.approx(180.0, abs=1e-9)
    text = next(n.text for n in path.notes if "frame" in n.text)
    assert text == "the file's frame: origin 10, 20, -1500 mm, X along 1, 0, 0, Z along 0, 0, 1"


def test_the_frame_can_be_ignored(read):
    path = read(CREO_CSYS, frame="ignore")
    assert path.frame is None and any("ignored" in n.text for n in path.notes)
    np.testing.assert_array_equal(path.tip, read(CREO_CSYS).tip)
    with pytest.raises(InputError, match="frame"):
        read(CREO_CSYS, frame="other")


def test_a_frame_an_operation(read):
    """Each operation's points are in its own MSYS; together they are in the first one."""
    one = "TOOL PATH/A,TOOL,T\nMSYS/5,0,0,1,0,0,0,1,0\nFEDRAT/MMPM,500\nRAPID\nGOTO/10,0,20,0.6,0,0.8\n"
    two = "TOOL PATH/B,TOOL,T\nMSYS/100,0,0,0,1,0,-1,0,0\nRAPID\nGOTO/10,0,20\nGOTO/0,0,0,1,0,0\n"
    for frame in ("file", "ignore"):
        path = read(one + two, frame=frame)
        np.testing.assert_allclose(path.tip, [[10, 0, 20], [95, 10, 20], [95, 0, 0]], atol=1e-12)
        # the tool is upright again in a new tool path
        np.testing.assert_allclose(path.axis, [[0.6, 0, 0.8], [0, 0, 1], [0, 1, 0]], atol=1e-12)


def test_the_axis_stays_where_only_the_origin_of_a_turned_frame_moves(read):
    turned = "MSYS/{},0,0,0.6,0.64,0.48,-0.8,0.48,0.36\n"
    path = read(turned.format(0) + "FEDRAT/9\nGOTO/0,0,0,0.6,0,0.8\n" + turned.format(5) + "GOTO/0,0,0\n")
    np.testing.assert_array_equal(path.axis[1], path.axis[0])
    np.testing.assert_allclose(path.tip[1], path.frame[:, :3].T @ [5, 0, 0], atol=1e-12)


# bounds and fuzz


@pytest.mark.parametrize(
    "statement", ["X1111111111" * 20 + "!", "GOTO/" + "1" * 60_000 + "x,0,0", "INSERT X" + "1" * 60_000]
)
def test_a_line_of_digits_without_end(read, statement):
    began = time.process_time()
    for head in ("", "UNIT/MM\n"):
        with contextlib.suppress(InputError):
            read(f"{head}FEDRAT/9\nGOTO/0,0,0\n{statement}\nGOTO/1,0,0\n")
    assert time.process_time() - began < 2.0


def test_a_file_of_arcs_without_end(read):
    arc = "CIRCLE/0,0,0,0,0,-1,{0},0.1,0.1,0.1,0.1\nGOTO/{0},0,0\n"
    begin = time.perf_counter()
    refused(read, "GOTO/1000000000,0,0\nFEDRAT/1000\n" + arc.format(1000000000) * 60, 4, "points")
    assert time.perf_counter() - begin < 1.0
    refused(read, "GOTO/50000000,0,0\nFEDRAT/1000\n" + arc.format(50000000) * 60, 66, "points in all")


def test_a_file_of_pecks_and_of_blanks_without_end(read, monkeypatch):
    monkeypatch.setattr("parakin.toolpath.reading.cl.motion._MOST_CYCLE_POINTS", 10_000)
    cycle = "SPINDL/9,RPM\nRAPID\nGOTO/0,0,9\nCYCLE/DEEP,DEPTH,90,STEP,.1,CLEAR,3,MMPM,9\n"
    begin = time.process_time()
    refused(read, cycle + "GOTO/0,0,0\n" * 9999, 8, "motions in all")  # 900 pecks, 2,700 motions a hole
    refused(read, "FEDRAT/9\nGOTO/1" + " " * 1_000_000 + "2,3,4\n", 2, "not a number")
    assert len(read("FEDRAT/9\nINSERT a" + " " * 1_000_000 + "b\nGOTO/1,2,3\n")) == 1
    assert time.process_time() - begin < 10.0


def mutate(text, rng):
    lines = text.split("\n")
    for _ in range(rng.randint(1, 4)):
        k = rng.randrange(len(lines))
        kind = rng.randrange(7)
        if kind == 0:
            del lines[k]
        elif kind == 1:
            lines.insert(k, rng.choice(lines))
        elif kind == 2:
            lines[k] = lines[k].replace(
                rng.choice("0123456789.,/$"), rng.choice(["", "-", "9e8", "1e-9", ",", "$", "0"]), 1
            )
        elif kind == 3:
            other = rng.choice(list(FILES.values())).split("\n")
            lines.insert(k, rng.choice(other))
        elif kind == 4:
            lines.insert(k, rng.choice(list(WORDS)) + rng.choice(["", "/", "/1", "/OFF", "/1,2,3", "/0,0,0,0,0,1,5"]))
        elif kind == 5:
            lines[k] = "".join(c for c in lines[k] if rng.random() > 0.05)
        else:
            numbers = re.findall(r"-?\d+\.?\d*", lines[k])
            if numbers:
                lines[k] = lines[k].replace(rng.choice(numbers), f"{rng.uniform(-50, 50):.3f}")
        lines = lines or [""]
    return "\n".join(lines)


@pytest.mark.parametrize("name", FILES)
def test_mutated_files(read, name):
    """No traceback, one line with the file, finite points, unit axes, and bounded time; cuts have feeds."""
    rng = random.Random(name)
    texts = [
        FILES[name],
        FILES[name].replace("FINI\n", TOP.format("CYCLE/DEEP,DEPTH,20,STEP,6,CLEAR,3,MMPM,100") + "FINI\n"),
    ]
    count = 0
    for _ in range(700):
        text = mutate(rng.choice(texts), rng)
        begin = time.perf_counter()
        with contextlib.suppress(InputError):
            path = read(text, arc_tolerance=0.1)
            count += 1
            assert np.isfinite(path.tip).all() and np.isfinite(path.feed[1:][~path.rapid[1:]]).all()
            assert np.abs((path.axis**2).sum(axis=1) - 1.0).max() < 1e-12
        assert time.perf_counter() - begin < 5.0, text
    assert count > 50


def test_a_straight_cut_proves_an_arc_against_a_dialect_that_only_words_tell(read):
    text = NX_HEADER + "FEDRAT/MMPM,9\nGOTO/-9,20,10\nGOTO/0,20,10\nCIRCLE/0,40,10,0,0,1,20,.1\nGOTO/20,40,10\n"
    path = read(text)
    assert turn_about(path.tip[1:], (0.0, 40.0)) == pytest.approx(90.0)
    assert [note.line for note in path.notes if "straight cut" in note.text] == [7]
    refused(read, "$$ Siemens NX\n" + text, 8, "way round")  # a header says more
    refused(read, text.replace("GOTO/20,40,10", "GOTO/-20,40,10"), 7, "way round")  # the proved way is the long one
    assert len(read(text + "GOTO/20,60,10\n")) == len(path) + 1
    refused(read, text + "GOTO/20,20,10\n", 7, "way round")  # the line after it proves the dialect's
