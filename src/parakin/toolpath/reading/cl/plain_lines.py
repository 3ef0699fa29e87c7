"""The fast reader of CL files: runs of plain GOTO lines, straight from bytes, in compiled code.

It accepts only what it reads exactly as the line reader does, and stops at the first line that is anything else: other
words, exponents, continuations, long mantissas, errors. The line reader then decides about that line.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....arrays import Array, Indices
from ....kernels.compiling import njit
from ..text import LARGEST
from .file_frames import AXIS_TOLERANCE, SMALLEST_SQUARE

# 10**22 is the last power of ten a double holds exactly. A mantissa up to 2**53 is exact too, so that one division
# of the two rounds correctly: the result is the one float() gives.
_POWERS = 10.0 ** np.arange(23)
_WHOLE = 2**53
_MOST_DIGITS = 18  # greatest number of digits of a mantissa that fits into int64
_SPACE, _TAB, _CR, _LF, _PLUS, _COMMA, _MINUS, _POINT, _SLASH, _ZERO, _DOLLAR = (ord(c) for c in " \t\r\n+,-./0$")
_G, _O, _T, _F, _E, _D, _R, _A, _P, _I, _N = (ord(c) for c in "gotfedrapin")
_LOWER = 0x20  # makes a letter small

_AT = np.uint64  # an unsigned index spares the compiled code the test for a negative one


class PlainRecords(NamedTuple):
    """The columns that the records go into: tip in the file's numbers and axis (cap, 3), source line (cap,)."""

    tip: Array
    axis: Array
    line: Indices


class AxisState(NamedTuple):
    """The modal tool axis (3,), and of vectors off unit length (3,): how many, first line, worst deviation."""

    axis: Array
    off_unit: Array


@njit(cache=True, nogil=True, inline="always")
def _begins_modal_word(buffer: NDArray[np.uint8], p: int) -> Any:
    """Tell whether FEDRAT, RAPID or PAINT begins at p, where at least six bytes are left."""
    a, b, c, d, e = (
        buffer[_AT(p)] | _LOWER,
        buffer[_AT(p + 1)] | _LOWER,
        buffer[_AT(p + 2)] | _LOWER,
        buffer[_AT(p + 3)] | _LOWER,
        buffer[_AT(p + 4)] | _LOWER,
    )
    if a == _F:
        return b == _E and c == _D and d == _R and e == _A and (buffer[_AT(p + 5)] | _LOWER) == _T
    if a == _R:
        return b == _A and c == _P and d == _I and e == _D
    return a == _P and b == _A and c == _I and d == _N and e == _T


@njit(cache=True, nogil=True, inline="always")
def _spells_goto(a: int, b: int, c: int, d: int) -> Any:
    """Tell whether four bytes are GOTO, in capitals or not."""
    return (a | _LOWER) == _G and (b | _LOWER) == _O and (c | _LOWER) == _T and (d | _LOWER) == _O


@njit(cache=True, nogil=True, inline="always")
def _set_axis(i: float, j: float, k: float, line: int, state: AxisState) -> Any:
    """Normalise a tool axis into the state; False for one without length."""
    square = i * i + j * j + k * k
    if not square > SMALLEST_SQUARE:
        return False
    norm = math.sqrt(square)
    deviation = abs(norm - 1.0)
    if deviation > AXIS_TOLERANCE:
        if state.off_unit[0] == 0.0:
            state.off_unit[1] = line
        state.off_unit[0] += 1.0
        state.off_unit[2] = max(state.off_unit[2], deviation)
    state.axis[0], state.axis[1], state.axis[2] = i / norm, j / norm, k / norm
    return True


@njit(cache=True, nogil=True)
def _read_run(buffer: NDArray[np.uint8], cursor: Indices, state: AxisState, records: PlainRecords) -> None:
    """Read GOTO lines up to the first one that is anything else; see :func:`read_goto_lines` for the parameters."""
    start, line, n = cursor[0], cursor[1], cursor[2]
    values = np.empty(6)
    # All bytes are read in this one function: to pass the buffer to another one costs more than to read a number.
    while start < buffer.size and n < records.line.size:
        p = start
        while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
            p += 1
        if buffer.size - p < 6:
            break
        if not _spells_goto(buffer[_AT(p)], buffer[_AT(p + 1)], buffer[_AT(p + 2)], buffer[_AT(p + 3)]):
            break
        p += 4
        while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
            p += 1
        count = 0
        separator = _SLASH
        while count < 6 and buffer[_AT(p)] == separator:
            p += 1
            while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
                p += 1
            negative = buffer[_AT(p)] == _MINUS
            p += np.int64(negative) | np.int64(buffer[_AT(p)] == _PLUS)  # no branch: signs are hard to predict
            mantissa, first = np.int64(0), p
            while np.uint8(buffer[_AT(p)] - _ZERO) < 10:
                mantissa = mantissa * 10 + np.int64(buffer[_AT(p)] - _ZERO)
                p += 1
            digits, decimals = p - first, 0
            if buffer[_AT(p)] == _POINT:
                p += 1
                first = p
                while np.uint8(buffer[_AT(p)] - _ZERO) < 10:
                    mantissa = mantissa * 10 + np.int64(buffer[_AT(p)] - _ZERO)
                    p += 1
                decimals = p - first
                digits += decimals
            if digits == 0 or digits > _MOST_DIGITS or mantissa > _WHOLE or mantissa / _POWERS[decimals] > LARGEST:
                count = 0
                break
            values[count] = mantissa / _POWERS[decimals] * (1.0 - 2.0 * negative)
            count += 1
            separator = _COMMA
            while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
                p += 1
        p += np.int64(buffer[_AT(p)] == _CR)
        if buffer[_AT(p)] != _LF or (count != 3 and count != 6):
            break
        if count == 6 and not _set_axis(values[3], values[4], values[5], line, state):
            break
        for c in range(3):
            records.tip[n, c] = values[c]
            records.axis[n, c] = state.axis[c]
        records.line[n] = line
        n += 1
        line += 1
        start = p + 1
    cursor[0], cursor[1], cursor[2] = start, line, n


@njit(cache=True, nogil=True)
def read_goto_lines(
    buffer: NDArray[np.uint8], cursor: Indices, state: AxisState, records: PlainRecords, modal_lines: Indices
) -> int:
    """Read plain GOTO lines until one is not plain, the buffer ends or the arrays are full.

    FEDRAT, RAPID and PAINT lines leave tip and axis alone: they are listed in ``modal_lines`` for the caller.

    buffer : whole lines; the last byte is a line feed
    cursor : position in the buffer, line number there, next free record; moved past what was read
    state : the modal axis and the vectors off unit length; updated
    records : filled from the next free record on
    modal_lines : (m, 4) start and end in the buffer, line number and next record of each line stepped over

    Returns how many lines were stepped over.
    """
    stepped_over = 0
    while True:
        _read_run(buffer, cursor, state, records)
        start = p = cursor[0]
        if start == buffer.size or cursor[2] == records.line.size:
            break
        while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
            p += 1
        if buffer[_AT(p)] != _LF:
            if buffer.size - p < 6 or stepped_over == len(modal_lines) or not _begins_modal_word(buffer, p):
                break
            while buffer[_AT(p)] != _LF and buffer[_AT(p)] != _DOLLAR:
                p += 1
            if buffer[_AT(p)] == _DOLLAR:
                break
            row = modal_lines[stepped_over]
            row[0], row[1], row[2], row[3] = start, p, cursor[1], cursor[2]
            stepped_over += 1
        cursor[0] = p + 1
        cursor[1] += 1
    return stepped_over
