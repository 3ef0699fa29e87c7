"""The tables of CL words, of all dialects; what differs between dialects is in :mod:`.dialects`.

To read a new word, add its row to WORDS. If it acts on motion, state or tool, write its method in :mod:`.actions`, with
the parser of its arguments in :mod:`.word_arguments`. A word that moves, turns, shifts or compensates and cannot be
honoured is a row of REFUSED; one that only informs is in INFORMING. Words without a row earn a note and do nothing, but
those that begin with GO or with a word of motion or of REFUSED, or are one letter off a word that acts, are refused.
"""

from collections.abc import Callable
from typing import NamedTuple

from .actions import ClActions


class Word(NamedTuple):
    """What a word does.

    act : the method that acts on the arguments and the source line; unbound, so that a reader is freed with its columns
        as soon as nobody uses it. None: no effect on the motion
    event : whether the statement is an event of the path
    ends_message : whether a message before the word has ended, for its text can't begin so
    slash : whether the word without a slash behind it is an error, and not another word that begins the same way
    whole : whether the method takes the statement as one text, in place of its arguments
    """

    act: Callable[[ClActions, list[str], int], None] | None = None
    event: bool = False
    ends_message: bool = False
    slash: bool = False
    whole: bool = False


_EVENT = Word(event=True)
_SILENT = Word()  # words for the display or the original post-processor only

WORDS: dict[str, Word] = {
    # motion
    "GOTO": Word(ClActions.go_to, ends_message=True, slash=True),
    "GODLTA": Word(ClActions.go_by, ends_message=True, slash=True),
    "FROM": Word(ClActions.start_from, ends_message=True, slash=True),
    "RAPID": Word(ClActions.set_rapid, ends_message=True),
    "INDIRV": Word(ClActions.set_arc_direction, ends_message=True, slash=True),
    "TLON": Word(ClActions.go_along_arc, ends_message=True, whole=True),
    "GOHOME": Word(ClActions.go_home, ends_message=True),
    "MOVARC": Word(ClActions.start_arc, ends_message=True, slash=True),
    "CIRCLE": Word(ClActions.start_circle, ends_message=True, slash=True),
    "CYCLE": Word(ClActions.set_cycle, ends_message=True),
    "FINI": Word(ClActions.end_program, event=True, ends_message=True),
    # feed, spindle
    "FEDRAT": Word(ClActions.set_feed, ends_message=True, slash=True),
    "SPINDL": Word(ClActions.set_spindle, event=True),
    "DELAY": Word(ClActions.wait, slash=True),
    "DWELL": Word(ClActions.wait, slash=True),
    "COOLNT": Word(ClActions.check_coolant, event=True),
    # units and frames
    "UNITS": Word(ClActions.set_units, slash=True),
    "UNIT": Word(ClActions.set_units, slash=True),
    "TLAXIS": Word(ClActions.set_tool_axis, slash=True),
    "MULTAX": Word(ClActions.set_axis_output, event=True),
    "ORIGIN": Word(ClActions.set_origin),
    "MSYS": Word(ClActions.set_frame, slash=True),
    "CSYS": Word(ClActions.set_csys, slash=True),
    "MCS": Word(ClActions.set_work_plane, slash=True),
    "MCS2": Word(ClActions.check_work_plane, slash=True),
    "ZERO": Word(ClActions.check_work_system, event=True),
    "FIXTUR": Word(ClActions.check_fixture, event=True),
    # modes that are honoured where they change nothing
    "CUTCOM": Word(ClActions.check_compensation),
    "CUTCOM_GEOMETRY_TYPE": Word(ClActions.set_compensation_type),
    "MODE": Word(ClActions.check_mode),
    "SET": Word(ClActions.check_setting),
    "TRACUT": Word(ClActions.check_off),
    "TRANS": Word(ClActions.check_off),
    # tool
    "TLDATA": Word(ClActions.set_tool_data),
    "CUTTER": Word(ClActions.set_cutter, event=True),
    "LOADTL": Word(ClActions.load_tool, event=True),
    "TOOLNO": Word(ClActions.load_tool, event=True),
    "LOAD": Word(ClActions.load_tool, event=True),
    "SELECT": Word(ClActions.select_tool, event=True),
    "SELECTL": Word(ClActions.select_tool, event=True),
    "TOOLPATH": Word(ClActions.start_tool_path, event=True),
    # no effect on the motion
    "STOP": _EVENT,
    "OPSTOP": _EVENT,
    "END": _EVENT,
    "MACHIN": _EVENT,
    "AUXFUN": _EVENT,
    "END-OF-PATH": _EVENT,
    "PAINT": _SILENT,
    "AUTOPS": _SILENT,
    "INTOL": _SILENT,
    "OUTTOL": _SILENT,
    "TOLER": _SILENT,
    "CLPRNT": _SILENT,
    "NOPOST": _SILENT,
}
TEXT_WORDS = ("PPRINT", "PARTNO", "REMARK", "TPRINT", "INSERT", "LETTER", "DISPLY")  # a free text follows; events

# words that move, turn, shift or compensate, by the reason why they cannot be honoured
REASONS = {
    "a motion along surfaces, which the file does not give as points": (
        "GO GOLFT GORGT GOFWD GOBACK GOUP GODOWN TLLFT TLRGT TLONPS TLOFPS PSIS POCKET PROFIL SCURV ARCSLP"
    ),
    "a motion along a curve, which the file does not give as points": "NURBS SPLINE BSPLIN PSPLIN ELLIPS HELIX PARSRF",
    "a motion to a place that the file does not state": "MOVETO DELTA ARCMOV PLUNGE POSITN SAFPOS TANSPT",
    "it shifts the tool or its axis along a surface": "THICK ZSURF VTLAXS OFFSET",
    "a statement of the APT language that repeats or leads to others": (
        "CALL CALSUB INCLUD SYN MACRO TERMAC LOOPST LOOPND JUMPTO TRANTO IF DO UNTIL SUBR ENDSUB INDEX"
    ),
    "it leaves out the motions that follow": "DNTCUT CUT",
    "it moves or copies the points that follow": "COPY MATRIX REFSYS MCSYS TRANSL MIRROR WPLANE SHIFT SCALE",
    "a compensation that is left to the controller": "TLCOMP",
    "it turns an axis of the machine that wrote the file": "ROTATE ROTABL ROTHED ROTREF POSMAP TURRET SADDLE",
    "it retracts to a place that the file does not state": "RETRCT RETRACT",
    "it gives the controller a G-code": "PREFUN",
    "a motion in step with the spindle": "THREAD PITCH COUPLE",
    "a motion that ends at a touch": "PROBE",
}
REFUSED = {word: reason for reason, words in REASONS.items() for word in words.split()}
_INFORMING = """
    AIR APPLY BARFED BEGIN BREAK CATCHR CHKPTS CHUCK CLAMP CLDATA CLDIST CLEARP CLRSRF CONTRL CSI_SET_EXTENSION_LENGTH
    CSI_SET_FLUTE_LENGTH CSI_SET_PATH_PARAM CSI_TOOL_PATH DATE FEATNO GECENT HEAD HEADER LEADER LINTOL MATERL MCHFIN
    MCHTOL MFGNO NOTE OFSTNO OPERATION OPNAME OPSKIP OPTION OSETNO OVPLOT PENDWN PENUP PLABEL PPTOL RESERV REWIND SAFETY
    SELCTL SEQNO SETSTL START SWITCH TCP TCPCTL TLSTCK TMARK UNLOAD VERSION
"""
INFORMING = frozenset(_INFORMING.split())
