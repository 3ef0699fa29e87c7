"""Damaged files of every CL dialect and of G-code: a path, or one line that names the file; never anything else.

PARAKIN_FUZZ sets how many files are read; one in PARAKIN_FUZZ_POSTED of them is posted, too. PARAKIN_SEED is the first.
"""

import os
import random
import time

import numpy as np
import pytest

from parakin.cli import main
from parakin.errors import InputError
from parakin.toolpath.reading.detect import read_path

COUNT = int(os.environ.get("PARAKIN_FUZZ", "2000"))
POSTED = int(os.environ.get("PARAKIN_FUZZ_POSTED", "200"))
FIRST = int(os.environ.get("PARAKIN_SEED", "0"))
GROUP = 250  # files of a test
READ_SECONDS, POST_SECONDS = 60.0, 120.0  # of the processor: the bounds of a million blocks or points; most take 1 ms

SEEDS = {
    "apt": """\
PARTNO PART
UNITS/MM
CUTTER/ 10.0, 2.0, 3.0, 2.0, 0.0,$
 0.0, 50.0
LOADTL/1,LENGTH,150
SPINDL/1200,RPM,CLW
FROM/0,0,-1400
RAPID
GOTO/0,0,-1420,0,0,1
FEDRAT/500,MMPM
GODLTA/10,0,-5
TLAXIS/0.1,0,0.9949874
GOTO/20,5,-1430
INDIRV/0,1,0
CYCLE/DEEP,DEPTH,12,STEP,5,CLEAR,2,MMPM,90
GOTO/20,0,-1450
CYCLE/OFF
STOP
FINI
""",
    "aptsource": """\
$$     CATIA APT VERSION 1.0
$$*CATIA0
$$ 001
$$     1.00000     0.00000     0.00000     0.00000
$$     0.00000     1.00000     0.00000     0.00000
$$     0.00000     0.00000     1.00000 -1450.00000
PARTNO PART
TOOLNO/1,MILL,1,0,   14.1,  100.0,$
  100.0,,   40.0
LOADTL/1,1,1
FEDRAT/ 1000.0000,MMPM
SPINDL/  70.0000,RPM,CLW
GOTO  /   20.00000,    0.00000,    0.00000
INDIRV/   0.00000,   1.00000,   0.00000
TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    0.00000,$
    20.00000),ON,2,INTOF,$
 (LINE/    0.00000,    0.00000,    0.00000,$
         0.00000,   20.00000,    0.00000)
GOTO  /   0.0,    40.0,    0.0, 0.1,0,0.9949874
FINI
""",
    "cls": """\
TOOL PATH/A,TOOL,BALL
TLDATA/MILL,10.0,5.0,75.0,0.0,0.0
MSYS/0,0,-1450,1,0,0,0,1,0
PAINT/PATH
LOAD/TOOL,1,ADJUST,1
SPINDL/RPM,8000,CLW
RAPID
GOTO/-60,0,50,0.1,0,0.99498744
FEDRAT/MMPM,1250
GOTO/0,20,0,0,0,1
CIRCLE/0,0,0,0,0,1,20,.06,.5,10,0
GOTO/20,0,0
CYCLE/DRILL,RAPTO,3,FEDTO,-10,RTRCTO,AUTO,DWELL,1,MMPM,250
GOTO/30,0,0
CYCLE/OFF
GOHOME/0,0,80
END-OF-PATH
TOOL PATH/B,TOOL,D6
TLDATA/MILL,6.0,0.0,50.0,0.0,0.0
LOAD/TOOL,2
FEDRAT/MMPM,100
GOTO/0,20,0
END-OF-PATH
""",
    "ncl": """\
$$*         Pro/CLfile  Version Creo Parametric 4.0
$$-> MFGNO / M1
PARTNO / M1
$$-> CUTCOM_GEOMETRY_TYPE / OUTPUT_ON_CENTER
UNITS / MM
LOADTL / 1, OSETNO, 1
$$-> CUTTER / 10.000000
$$-> CSYS / 1.0, 0.0, 0.0, 0.0,  $
         0.0, 1.0, 0.0, 0.0,  $
         0.0, 0.0, 1.0, -1450.0
SPINDL / RPM, 900, CLW
RAPID
GOTO / 0, 20, 20
FEDRAT / 500, MMPM
GOTO / 0, 20, 0
CIRCLE / 0, 0, 0, 0, 0, -1, 20
GOTO / 14.142136, 14.142136, 0
GOTO / 20, 0, 0
CUTCOM / LEFT
CYCLE / TAP, DEPTH, 6, MMPR, 1.25, CLEAR, 3.0
GOTO / 30, 0, 0
CYCLE / OFF
FINI
""",
    "cl": """\
PARTNO/1
UNIT/INCH
LOADTL/5,5.90551181
SPINDL/3000,RPM,CLW
RAPID/
GOTO/1.0,2.0,-55.0
CYCLE/DRILL,FEDTO,.5,IPM,12.,RAPTO,.2,RTRCTO,1.
GOTO/1,2,-57
CYCLE/OFF
FEDRAT/10.,IPM
GOTO/2,0,-56
GOTO/1,0,-56
CIRCLE/0,0,-56,0,0,1,1
GOTO/0,1,-56
FINI
""",
    "autodesk.apt": """\
MODE/MILL
PARTNO/'1001'
UNITS/MM
MULTAX/OFF
CUTTER/10.0, 0.0, 10.0, 0.0, 0.0, 0.0, 30.0
LOADTL/1, 0, 50.000000, 1
SPINDL/5000., RPM, CLW
RAPID
GOTO/10., 0., -1400.
FEDRAT/300., MMPM
GOTO/10., 0., -1450.
MOVARC/0., 0., -1450., 0., 0., 1., 10., ANGLE, 90.
GOTO/0., 10., -1450.
COOLNT/OFF
END
FINI
""",
    "camplete.apt": """\
MACHIN/M
CSI_TOOL_PATH/FACE
UNITS/MM
MCS/1.0, 0.0, 0.0, $
0.0, 1.0, 0.0, $
0.0, 0.0, 1.0, $
0.0, 0.0, -1450.0
MCS2/1,0,0,0,1,0,0,0,1
LOADTL/1, 0, 50.0, 1
FEDRAT/300, MMPM
GOTO/20, 0, 0
CIRCLE/0, 0, 0, 0, 0, -1, 20, 90., 0.0, 0.0, 0.0
GOTO/0, 20, 0
END
FINI
""",
    "ngc": """\
%
(PART)
G21 G90 G17 G40 G49 G54
G10 L2 P1 Z-1
#1=5 #<deep>=[#1*2+sin[30]]
o100 sub
G1 X[#1] F100
o100 endsub
T1 M6
S6000 M3 M8
G0 X0 Y0 Z-1400
o100 call [4]
G1 X0 Y0
G2 X10 Y10 I5 J5 F300
G18 G3 X0 Z-1410 R20
G17
o1 while [#1 GT 3]
#1=[#1-1]
G1 X#1 Y#<deep>
o1 endwhile
G98 G83 X10 Y0 Z-1420 R-1405 Q5 F90
G80
G92 X5
G92.1
M62 P1
G4 P0.5
G93 G1 X1 A1 B2 C3 F2
G94
M5
M30
%
""",
}
_NUMBERS = "0 -0 1e9 -1e9 1e308 -1e-308 nan inf 1e400 0.0000001 999999999999 -3 .5 5. 2,,3 . - +-1 1.2.3 --1"
NUMBERS = _NUMBERS.split()
_WORDS = """
    RAPID GOTO/0,0,0 GODLTA/1,0,0 CIRCLE/0,0,0,0,0,1,9 CYCLE/DRILL CYCLE/ON UNITS/INCHES UNITS/MM MSYS/0,0,0,1,0,0,0,1,0
    ORIGIN/1,2,3 TLAXIS/0,0,0 FEDRAT/0 LOADTL/2 CUTCOM/LEFT FINI $$*CATIA0 COPY/1 GOHOME $ $$ G91 G20 G19 G33 G41 G92
    G43.4 M98 M6 O1 o1 #1=[ ( % ; / G95 G28 M30 X Y Z# [1/0]
"""
WORDS = _WORDS.split()


def damage(text: str, chance: random.Random) -> bytes:
    """Make one to six changes to a text: of numbers, words, lines, characters, or where it ends."""
    lines = text.splitlines(keepends=True)
    for _ in range(chance.randint(1, 6)):
        at = chance.randrange(len(lines)) if lines else 0
        line = lines[at] if lines else ""
        kind = chance.randrange(9)
        if kind == 0:
            fields = line.split(",")
            fields[chance.randrange(len(fields))] = chance.choice(NUMBERS)
            lines[at : at + 1] = [",".join(fields).rstrip("\n") + "\n"]
        elif kind == 1:
            lines.insert(at, chance.choice(WORDS) + "\n")
        elif kind == 2:
            del lines[at : at + chance.randint(1, 3)]
        elif kind == 3:
            lines[at:at] = lines[at : at + chance.randint(1, 4)] * chance.randint(1, 3)
        elif kind == 4:
            other = chance.choice(list(SEEDS.values())).splitlines(keepends=True)
            lines.insert(at, chance.choice(other))
        elif kind == 5 and line:
            place = chance.randrange(len(line))
            lines[at] = (
                line[:place] + chr(chance.choice([0, 9, 27, 36, 37, 44, 47, 57, 88, 233, 8364])) + line[place + 1 :]
            )
        elif kind == 6 and line:
            place = chance.randrange(len(line))
            lines[at] = line[:place] + chance.choice(NUMBERS) + line[place:]
        elif kind == 7:
            chance.shuffle(lines)
        elif kind == 8 and line:
            lines[at:] = [line[: chance.randrange(len(line) + 1)]]
    return "".join(lines).encode("utf-8", "surrogateescape" if chance.random() < 0.5 else "replace")


def check_path(path) -> None:
    """What holds of any path that is read."""
    assert len(path) and np.isfinite(path.tip).all() and np.abs(np.linalg.norm(path.axis, axis=1) - 1.0).max() < 1e-9
    assert (path.line > 0).all() and not (path.feed < 0.0).any()
    if path.dialect != "gcode":
        assert (path.feed[1:][~path.rapid[1:]] > 0.0).all()  # no feed, no cut; the first record is where it starts


def check_message(message: str, name: str) -> None:
    """One line, which begins with the file."""
    assert message.startswith(f"{name}:") and message.isprintable() and len(message) < 1000, message


def check_post(file, capsys) -> None:
    """A program and a report, or one line; no half file."""
    out = file.parent / f"{file.stem}-out"
    capsys.readouterr()
    code = main(["post", str(file), "-m", "tricept", "-o", str(out), "--target", "linuxcnc"])
    said = capsys.readouterr()
    assert code in (0, 2, 3) and "Traceback" not in said.out + said.err
    written = sorted(path.name for path in out.iterdir()) if out.exists() else []
    assert not [name for name in written if name.endswith(".part")]
    if code == 2:
        assert not written and said.out == "" and said.err.count("\n") == 1
        check_message(said.err.rstrip("\n"), str(file))
    else:
        assert [name for name in written if name.endswith(".report.html")]
        assert (code == 0) == any(name.endswith(".ngc") for name in written)


@pytest.mark.parametrize("first", range(FIRST, FIRST + COUNT, GROUP))
def test_damaged_files(first, tmp_path, capsys):
    for seed in range(first, min(first + GROUP, FIRST + COUNT)):
        chance = random.Random(seed)
        suffix, text = chance.choice(list(SEEDS.items()))
        file = tmp_path / f"part{seed}.{suffix}"
        file.write_bytes(damage(text, chance))
        start = time.process_time()
        try:
            check_path(read_path(file))
        except InputError as error:
            check_message(str(error), str(file))
        except Exception as error:
            raise AssertionError(f"seed {seed}: {file.read_bytes()!r}") from error
        assert time.process_time() - start < READ_SECONDS, f"seed {seed}"
        if seed % POSTED == 0:
            check_post(file, capsys)
            assert time.process_time() - start < POST_SECONDS, f"seed {seed}"
        file.unlink()


@pytest.mark.parametrize("suffix", SEEDS)
def test_the_seeds_are_read(suffix, tmp_path):
    file = tmp_path / f"part.{suffix}"
    file.write_text(SEEDS[suffix])
    check_path(read_path(file))
