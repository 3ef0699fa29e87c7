"""The table of CL words, in the APT dialect that CATIA writes and the one of Siemens NX.

To read a new word, add its row to WORDS. If it acts on motion, state or tool, write its method in :mod:`.actions`, with
the parser of its arguments in :mod:`.arguments`. Words without a row earn a note and do nothing.
"""

from collections.abc import Callable
from typing import NamedTuple

from .actions import ClActions


class Word(NamedTuple):
    """What a word does.

    act : the method that acts on the arguments and the source line; unbound, so that a reader is freed with its columns
        as soon as nobody uses it. None: no effect on the motion
    event : whether the statement is an event of the path
    nx : whether the word tells that the file is Siemens NX's
    ends_message : whether a message before the word has ended, for its text can't begin so
    slash : whether the word without a slash behind it is an error, and not another word that begins the same way
    whole : whether the method takes the statement as one text, in place of its arguments
    """

    act: Callable[[ClActions, list[str], int], None] | None = None
    event: bool = False
    nx: bool = False
    ends_message: bool = False
    slash: bool = False
    whole: bool = False


_EVENT = Word(event=True)
_SILENT = Word()  # for the display or the original post-processor only

WORDS: dict[str, Word] = {
    # motion
    "GOTO": Word(ClActions.go_to, ends_message=True, slash=True),
    "GODLTA": Word(ClActions.go_by, ends_message=True, slash=True),
    "FROM": Word(ClActions.start_from, ends_message=True, slash=True),
    "RAPID": Word(ClActions.set_rapid, ends_message=True),
    "INDIRV": Word(ClActions.set_arc_direction, ends_message=True, slash=True),
    "TLON": Word(ClActions.go_along_arc, ends_message=True, whole=True),
    "CIRCLE": Word(ClActions.start_circle, nx=True, ends_message=True, slash=True),
    "CYCLE": Word(ClActions.set_cycle, ends_message=True),
    "FINI": Word(ClActions.end_program, event=True, ends_message=True),
    # feed, spindle
    "FEDRAT": Word(ClActions.set_feed, ends_message=True, slash=True),
    "SPINDL": Word(ClActions.set_spindle, event=True),
    # units and frames
    "UNITS": Word(ClActions.set_units, slash=True),
    "TLAXIS": Word(ClActions.set_tool_axis, slash=True),
    "ORIGIN": Word(ClActions.set_origin),
    "MSYS": Word(ClActions.set_frame, nx=True, slash=True),
    # tool
    "TLDATA": Word(ClActions.set_tool_data, nx=True),
    "CUTTER": Word(ClActions.set_cutter, event=True),
    "LOADTL": Word(ClActions.load_tool, event=True),
    "TOOLNO": Word(ClActions.load_tool, event=True),
    "LOAD": Word(ClActions.load_tool, event=True, nx=True),
    "SELECT": Word(ClActions.load_tool, event=True, nx=True),
    "TOOLPATH": Word(ClActions.start_tool_path, event=True, nx=True),
    # no effect on the motion
    "STOP": _EVENT,
    "OPSTOP": _EVENT,
    "COOLNT": _EVENT,
    "MULTAX": _EVENT,
    "END": _EVENT,
    "MACHIN": _EVENT,
    "AUXFUN": _EVENT,
    "DELAY": _EVENT,
    "DWELL": _EVENT,
    "END-OF-PATH": Word(event=True, nx=True),
    "PAINT": Word(nx=True),
    "AUTOPS": _SILENT,
    "INTOL": _SILENT,
    "OUTTOL": _SILENT,
    "TOLER": _SILENT,
    "CLPRNT": _SILENT,
    "NOPOST": _SILENT,
}
TEXT_WORDS = ("PPRINT", "PARTNO", "REMARK", "TPRINT", "INSERT", "LETTER", "DISPLY")  # a free text follows; events
