"""Write docs/files.md, the page on the files that parakin reads, from the tables of the readers.

python scripts/reading_page.py          # writes the page
python scripts/reading_page.py --check  # exit code 1 if the page is not current
"""

import argparse
import inspect
import re
import sys
from pathlib import Path

from parakin.commands import part_options
from parakin.controllers.event_commands import COMMENTED
from parakin.toolpath.reading.cl.cycles import CYCLES
from parakin.toolpath.reading.cl.dialects import BELOW, DIALECTS, DOWN, HEIGHT, LEFT, RIGHT, SAME, Dialect
from parakin.toolpath.reading.cl.length_units import INCH_SPEEDS
from parakin.toolpath.reading.cl.words import INFORMING, REASONS, TEXT_WORDS, WORDS
from parakin.toolpath.reading.gcode.codes import (
    G_GROUPS,
    G_REFUSED,
    GROUP_TITLES,
    M_GROUPS,
    M_REFUSED,
    M_WORDS,
    format_g_code,
)
from parakin.toolpath.reading.gcode.controls import CONTROLS

PAGE = Path(__file__).parents[1] / "docs" / "files.md"

HEAD = """\
# Files that parakin reads

`parakin post PART` reads CL files (APT, and what CAM systems make of it) and G-code (RS274/NGC, as LinuxCNC reads
it). The suffixes `.ngc .nc .gcode .tap .cnc` are G-code, `.apt .aptsource .cl .cls .ncl` are CL files; of other files
the first line that only one of the two can have decides. What moves, turns, shifts or compensates is honoured, or
refused in one line with file and line number; what only informs is listed once. This page is written by
`scripts/reading_page.py` from the tables that the readers go by.
"""

TOOLS = """\
## Tools and their lengths

The machine's own tool is what ends its head (`tz: -tool` in its file); its kinematics, also that of LinuxCNC, knows
that length. For a longer or shorter tool the program goes where the machine's own tip would be, so that the real
tip is on the path; between records too. Summary, report, JSON and the program's head say which lengths count:

| what is known | what counts |
|---|---|
| `--tool-length MM` | the longest tool is so long, others by what their cutters are shorter |
| `--tool-length file` | the lengths in the file, of cutters too |
| `--tool-length machine` | the machine's own, for all tools |
| `--tools FILE` | the Z of LinuxCNC's tool table, by the number of LOADTL, T or G43 H |
| `LOADTL/n,LENGTH,l`, `G10 L1`, `G43.1` | from nose to tip; refused where it is not the machine's own |
| `LOADTL/n,l` | the same of SolidWorks CAM; in a dialect that no header tells it is noted and not taken |
| `TLDATA` of a tool that is loaded by number and tilts | refused where it is not the own tool's |
| other `TLDATA`, `CUTTER` with a height | what sticks out of the holder: refused where longer than the own tool |
| `LOADTL/n,pocket,l` | the same of Autodesk |
| several cutters | the longest as the machine's own tool, others by what they are shorter |
| nothing | the machine's own |

One rule is behind it: without an option nothing runs that contradicts the machine's own tool. A length from the nose
to the tip contradicts it where it differs; what sticks out of a holder of unknown length only where it is longer. CAM
systems write the cutter's length (often one that nobody set, as the 75 mm of NX) and not the holder's: a shorter cutter
is told beside the length that counts, wherever that is told, and `--tool-length file` takes it for the whole tool.
TLDATA may mean either. Along the part's Z a wrong length is a shift of the zero, which is set with the tool in the
spindle; once the tool tilts, nothing on the machine takes it away. So TLDATA of a tool that is loaded by number and
tilts has to be as long as the machine's own tool, or an option says what counts.

A table of lengths 0 only, as `parakin linuxcnc` writes it, leaves all to the machine's own tool. Where G43 has lengths
from a table, G53 and G28 tell of the spindle's nose, as on a machine with such a table; else of the own tool's tip.

Before a change of the tool it is withdrawn along its axis: from a cut by 20 mm (less where the machine can't), and
by what the next one is longer; what the file says before the change, a dwell or a stop, happens before that.
Spindle and coolant are stopped (M5, M9) before the stop for the operator (M0), whom a message tells tool and length;
they start again where the file says so.
"""


def make_page() -> str:
    """Make the page."""
    parts = [HEAD, *list_dialects(), *list_words(), *list_codes(), TOOLS, *list_options()]
    return "\n".join(parts)


def list_dialects() -> list[str]:
    """List the dialects of CL files."""
    rows = [
        (dialect.title, describe_signs(dialect), describe_hand(dialect.circle), describe_fedto(dialect))
        for dialect in DIALECTS.values()
    ]
    text = (
        "## Dialects of CL files\n\n"
        "The file tells its dialect by a comment before the first motion or by words that only one system writes; the "
        "notes name it. A machine of PTC Creo's own (`MACHIN/UNCX01`) and a `CIRCLE` of eight values (Siemens NX) tell "
        "it too.\nA motion that joins an arc tangentially proves which way round it goes; one that contradicts "
        "the dialect is refused, unless the arc is shorter than half a turn and others of the file prove the dialect. "
        "Where words alone tell the dialect, a straight cut into an arc of less than half "
        "a turn goes before it, with a note.\n"
    )
    senses = {SAME: "another is refused", DOWN: "counts down from CLEAR", HEIGHT: "CLEAR is a height, RAPTO a distance"}
    reasons = [f"- {dialect.title}: {dialect.cycle_values}" for dialect in DIALECTS.values()]
    cycles = ["Values of a `CYCLE` by position are refused:\n", *reasons, ""]
    axes = {True: "upright", False: "refused after a tilted tool"}
    rows = [
        (*row, senses[dialect.clear], axes[dialect.upright])
        for row, dialect in zip(rows, DIALECTS.values(), strict=True)
    ]
    titles = (
        "dialect", "told by", "CIRCLE turns", "FEDTO of a cycle", "RAPTO beside CLEAR",
        "points without an axis after MULTAX/OFF",
    )  # fmt: skip
    return [text, make_table(titles, rows), *cycles]


def describe_signs(dialect: Dialect) -> str:
    """Describe what tells a dialect."""
    header = (dialect.header or "").replace(r"\b", "").replace(r"\s*", " ").replace("\\", "").replace(" ?", " ")
    signs = [f"`{sign}`" for sign in header.split("|") if sign] + [f"`{word}`" for word in dialect.words]
    return ", ".join(signs) or "nothing else"


def describe_hand(hand: int) -> str:
    """Describe which way round arcs go."""
    names = {RIGHT: "right-handed about its axis", LEFT: "left-handed about its axis"}
    return names.get(hand, "as its neighbours prove")


def describe_fedto(dialect: Dialect) -> str:
    """Describe the sense of FEDTO."""
    if dialect.fedto == BELOW:
        return "a distance below the point"
    return "along the tool's axis, negative below the point" + ("" if dialect.fedto else "; a positive one is refused")


def list_words() -> list[str]:
    """List the words of CL files."""
    acting = [(f"`{name}`", describe_act(word.act)) for name, word in WORDS.items() if word.act is not None]
    passed = [name for name, word in WORDS.items() if word.act is None and word.event]
    silent = [name for name, word in WORDS.items() if word.act is None and not word.event]
    refused = [(reason, join_names(words.split())) for reason, words in REASONS.items()]
    return [
        "## Words of CL files\n",
        "Lengths are in mm until UNITS or UNIT says otherwise. A file without either whose speeds are in inches or "
        f"feet\n({join_names(sorted(INCH_SPEEDS))}) is refused: its lengths are hardly mm, and taken for them the path "
        "would be\n25.4 times too small.\n",
        make_table(("word", "what it does"), acting),
        make_table(
            ("words", "what becomes of them"),
            [
                (join_names(CYCLES), "kinds of `CYCLE`, written out as motion"),
                (join_names(passed), "kept in order; what a controller has a code for is passed on"),
                (
                    join_names(TEXT_WORDS),
                    "texts, kept in order as comments; one M code of `INSERT` is passed on, a block is refused (of "
                    "SolidWorks CAM, which describes tools and stock in it, only where it is nothing else)",
                ),
                (join_names(silent), "no effect"),
                (join_names(sorted(INFORMING)), "only inform; listed once"),
            ],
        ),
        "Refused with their line:\n",
        make_table(("why", "words"), refused),
        "A word that is not here earns a note; one that begins with GO, as a word of motion or one refused does "
        "(`CYCLE81`, `CALLSUB`), is one letter off a word that acts, or stands "
        "before numbers alone, as many as a point or a frame has, is "
        "refused.\n",
    ]


def describe_act(act: object) -> str:
    """Describe a word by the first line of its method, without the word itself."""
    first = (inspect.getdoc(act) or "").split("\n")[0]
    return re.sub(r"\s*\([A-Z][^()]*\)(?=\.$|$)", "", first).rstrip(".").replace("|", "\\|")


def list_codes() -> list[str]:
    """List the codes of G-code."""
    rows = [(join_names(map(format_g_code, group)), GROUP_TITLES[name]) for name, group in G_GROUPS.items()]
    rows += [(join_names(f"M{code}" for code in group), GROUP_TITLES[name]) for name, group in M_GROUPS.items()]
    others = sorted(set(M_WORDS) - {code for group in M_GROUPS.values() for code in group})
    passed = [code for code in others if code not in COMMENTED]
    rows.append((join_names(f"M{code}" for code in passed), "modes of the controller; they pass through"))
    rows.append((join_names(f"M{code}" for code in others if code not in passed), "kept as comments"))
    rows.append(
        (
            "other M codes to M199",
            "a note; they pass through with their words P, Q, R, E and L; greater ones into no program",
        )
    )
    refused: dict[str, list[str]] = {}
    for code, reason in G_REFUSED.items():
        refused.setdefault(reason, []).append(format_g_code(code))
    for code, reason in M_REFUSED.items():
        refused.setdefault(reason, []).append(f"M{code}")
    return [
        "## G-code\n\nAlso read: expressions and functions, polar `@` and `^`, `#` parameters by number and name, O "
        "words\n(`sub call if while do repeat`) within the file, `%`, comments and `(MSG, ...)`, N, and `/`, whose "
        "blocks are executed.\n",
        make_table(("codes", "what they do"), rows),
        "Refused with their line:\n",
        make_table(("codes", "why"), [(join_names(codes), reason) for reason, codes in refused.items()]),
        f"Programs of {'; '.join(control.name for control in CONTROLS)}: recognised where a line is refused.\n",
    ]


def list_options() -> list[str]:
    """List the options that say how a file is read."""
    names = {
        "FrameChoice": "--frame file\\|ignore",
        "Start": "--start X=..,Y=..,Z=..",
        "Reference": "--reference X=..,Y=..,Z=..",
        "ToolTable": "--tools FILE",
        "ToolLengthText": "--tool-length MM\\|file\\|machine",
    }
    rows = [(f"`{text}`", getattr(part_options, name).__metadata__[0].help) for name, text in names.items()]
    return ["## Options\n", make_table(("option", "meaning"), rows)]


def join_names(names) -> str:
    """Join names as code."""
    return ", ".join(f"`{name}`" for name in names)


def make_table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Make a table in Markdown."""
    lines = [head, ("---",) * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def main() -> int:
    """Write the page, or check it."""
    parser = argparse.ArgumentParser(description="write docs/files.md from the readers' tables")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if the page is not current")
    page = make_page()
    if parser.parse_args().check:
        return int(not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page)
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
