"""What CL files say besides motion, all the way into the program: spindle, dwell, coolant, inserted blocks."""

import math

import numpy as np
import pytest
from cl_reading import refused, text_reader

from parakin.controllers.event_commands import list_commands
from parakin.errors import PoseError


@pytest.fixture
def read(tmp_path):
    return text_reader(tmp_path)


def said(path):
    """What stands before each record, and after the last: words, and the speed that the file gives the record."""
    commands = list_commands(path, [event.record for event in path.events])
    texts = [[c.text for c in commands.get(k, []) if c.kind in ("code", "own", "dwell")] for k in range(len(path) + 1)]
    return texts, path.spindle.tolist()


def cut(*statements):
    """A file that cuts on by 1 mm after each statement."""
    lines = [f"{text}\nGOTO/{k + 1},0,0" for k, text in enumerate(statements)]
    return "CUTTER/8\nFROM/0,0,0\nFEDRAT/100,MMPM\n" + "\n".join(lines) + "\nFINI\n"


@pytest.mark.parametrize("way", ["CLW", "CCLW"])
def test_a_spindle_switched_on_again_turns_at_its_last_speed(read, way):
    path = read(cut(f"SPINDL/900,RPM,{way}", "SPINDL/OFF", "SPINDL/ON", "SPINDL/0", "SPINDL/ON"))
    on = "S900 M3" if way == "CLW" else "S900 M4"
    texts, speeds = said(path)
    assert texts[1:6] == [[on], ["M5"], [on], ["M5"], [on]]
    assert speeds[1:] == [900.0, 0.0, 900.0, 0.0, 900.0]


def test_a_feed_per_revolution_follows_the_spindle_switched_on_again(read):
    path = read(cut("SPINDL/900,RPM,CLW\nFEDRAT/0.1,MMPR", "SPINDL/OFF\nSPINDL/ON"))
    assert path.feed[1:].tolist() == [90.0, 90.0]


@pytest.mark.parametrize(("unit", "mm"), [("SMM", 1000.0), ("SFM", 304.8)])
def test_a_surface_speed_is_that_of_the_cutter_in_use(read, unit, mm):
    path = read("UNITS/MM\n" + cut(f"SPINDL/{unit},50,CLW", f"LOADTL/2\nCUTTER/20\nSPINDL/50,{unit}"))
    np.testing.assert_allclose(math.pi * np.array([8.0, 20.0]) * path.spindle[1:], 50.0 * mm)
    assert said(path)[0][1] == [f"S{path.spindle[1]:.10g} M3"]
    refused(read, cut("LOADTL/2\nSPINDL/50,SMM"), 5, "diameter")


def test_dwells(read):
    path = read(cut("SPINDL/120,CLW\nDELAY/5,REV", "DWELL/1.5", "DELAY/SEC,2", "DELAY/REV,1"))
    assert said(path)[0][1:5] == [["S120 M3", "2.5"], ["1.5"], ["2"], ["0.5"]]
    for text in ("DELAY/-1", "DELAY/nan", "DELAY", "DWELL/ON", "DELAY/5,REV"):
        refused(read, cut(text), 4, text.partition("/")[0])


def test_a_coolant_without_a_code_is_noted(read):
    path = read(cut("COOLNT/THRU", "COOLNT/ON,FLOOD", "COOLNT"))
    assert said(path)[0][1:4] == [[], ["M8"], []]
    assert said(read(cut("COOLNT/FLOOD,OFF", "COOLNT/OFF,MIST")))[0][1:3] == [["M9"], ["M9"]]
    assert [(note.line, "coolant" in note.text) for note in path.notes] == [(4, True), (8, True)]


@pytest.mark.parametrize(
    "block",
    [" G0 X100", " M3 S500", "/G53Z0", '/"T5"', " n10 m8", " G68.2 X0 (a)", " M8 (b)", " TRANS X=5", " R1=2",
     " G54;G0 X5", " CYCLE800(1)", " A = -.5", "/M8$\nINSERT G0 X5"],
)  # fmt: skip
def test_a_block_for_the_controller_is_refused(read, block):
    refused(read, cut(f"INSERT{block}"), 4, "INSERT")


def test_solidworks_describes_tools_and_stock_in_insert(read):
    texts = ["INSERT/[HOLDER=C40-M12EM2] 14MM CRB 2FL 32 LOC", "INSERT/Stock Size X135. Y135. Z32.5"]
    path = read("UNIT/MM\n" + cut(*texts))
    assert [note.line for note in path.notes if "comment" in note.text] == [5]
    for block in ("G0 X100", "N10 M8 Y-.5"):
        refused(read, "UNIT/MM\n" + cut(f"INSERT/{block}"), 5, "INSERT")
    refused(read, cut(texts[1]), 4, "INSERT")


def test_an_inserted_code_is_passed_on_or_refused(read):
    assert said(read(cut("INSERT M62", 'INSERT/"M07"', "INSERT MIND THE CLAMP 5")))[0][1:4] == [["M62"], ["M7"], []]
    assert said(read(cut("INSERT/M62").replace("FINI", "INSERT/M30\nFINI")))[0][1] == ["M62"]
    path = read(cut("INSERT MIND THE CLAMP 5", "INSERT (G0 X5)\nINSERT ; G0 X5"))
    assert [(note.line, "comment" in note.text) for note in path.notes] == [(4, True)]
    for code in (6, 30, 98, 600):
        with pytest.raises(PoseError, match=f":4: INSERT/M{code} can't be passed on"):
            said(read(cut(f"INSERT/M{code}", "STOP")))


def test_a_tool_is_not_changed_within_a_cycle(read):
    refused(read, cut("CYCLE/DRILL,DEPTH,5,CLEAR,2", "LOADTL/2"), 6, "LOADTL", "CYCLE/OFF")


@pytest.mark.parametrize("word", ["SHIFTT", "ARCPT", "DELTA", "SADDLE"])
def test_unknown_words_with_coordinates_are_refused(read, word):
    refused(read, cut(f"{word}/1,2,-3.5"), 4, word)


def test_unknown_words_without_coordinates_are_noted(read):
    path = read(cut("COLOUR/1,2", "STOCKX/BLOCK,1,2,3"))
    assert [note.line for note in path.notes] == [4, 6]


def test_a_feed_behind_rapid_is_told(read):
    path = read(cut("RAPID\nFEDRAT/50,MMPM", "RAPID\nSPINDL/9", "FEDRAT/70,MMPM\nRAPID"))
    assert path.rapid.tolist() == [False, True, True, True]
    assert [note.line for note in path.notes] == [5]


@pytest.mark.parametrize("tool", ["LOADTL/2,LENGTH,-5", "CUTTER/5,0,0,0,0,0,-1", "TLDATA/MILL,5,0,-1,0,0"])
def test_a_tools_length_below_zero_is_refused(read, tool):
    refused(read, cut(tool), 4, "below zero")
