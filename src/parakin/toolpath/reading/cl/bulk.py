"""Runs of plain GOTO lines, straight from bytes.

The kernel takes only what it reads exactly as the line reader would, and stops at the first line that is anything
else: other words, exponents, continuations, long mantissas, errors. The line reader then decides about that line.
"""

import math
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from .tokens import AXIS_TOLERANCE, LARGEST, SMALLEST_SQUARE

# 10**22 is the last power of ten a double holds exactly. A mantissa up to 2**53 is exact too, so that one division
# of the two rounds correctly: the result is the one float() gives.
_POWERS = 10.0 ** np.arange(23)
_EXACT = 2**53
_SPACE, _TAB, _CR, _LF, _PLUS, _COMMA, _MINUS, _POINT, _SLASH, _ZERO, _DOLLAR = (ord(c) for c in " \t\r\n+,-./0$")
_G, _O, _T = (ord(c) for c in "got")
_LOWER = 0x20


_AT = np.uint64  # an unsigned index spares the compiled code the test for a negative one


@nb.njit(cache=True, nogil=True, inline="always")
def _steps_over(buffer: NDArray[np.uint8], p: int) -> Any:
    """Whether FEDRAT, RAPID or PAINT begins at p, where at least six bytes are left."""
    a, b, c, d, e = (
        buffer[_AT(p)] | 32,
        buffer[_AT(p + 1)] | 32,
        buffer[_AT(p + 2)] | 32,
        buffer[_AT(p + 3)] | 32,
        buffer[_AT(p + 4)] | 32,
    )
    if a == 102:
        return b == 101 and c == 100 and d == 114 and e == 97 and (buffer[_AT(p + 5)] | 32) == 116
    if a == 114:
        return b == 97 and c == 112 and d == 105 and e == 100
    return a == 112 and b == 97 and c == 105 and d == 110 and e == 116


@nb.njit(cache=True, nogil=True)
def goto_run(
    buffer: NDArray[np.uint8],
    cursor: NDArray[np.int64],
    axis_now: NDArray[np.float64],
    off_unit: NDArray[np.float64],
    tip: NDArray[np.float64],
    axis: NDArray[np.float64],
    line: NDArray[np.int64],
    aside: NDArray[np.int64],
) -> int:
    """Read plain GOTO lines until one is not plain, the buffer ends or the arrays are full.

    FEDRAT, RAPID and PAINT lines leave tip and axis alone: they are listed in ``aside`` for the caller.

    buffer : whole lines, the last byte is a line feed
    cursor : position in the buffer, line number there, next free record; moved past what was read
    axis_now : (3,) the modal axis, updated
    off_unit : vectors off unit length: how many, first line, worst deviation; updated
    tip, axis, line : (cap, 3), (cap, 3), (cap,), filled from the next free record on; tip in the file's numbers
    aside : (m, 4) start and end in the buffer, line number and next record of each line stepped over

    Returns how many lines were stepped over.
    """
    pos, number, n = cursor[0], cursor[1], cursor[2]
    end, cap = buffer.size, line.size
    value = np.empty(6)
    asides = 0
    while pos < end and n < cap:
        p = pos
        while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
            p += 1
        if buffer[_AT(p)] == _LF:
            number += 1
            pos = p + 1
            continue
        if end - p < 6:
            break
        if (buffer[_AT(p)] | _LOWER) != _G:
            if asides == aside.shape[0] or not _steps_over(buffer, p):
                break
            while buffer[_AT(p)] != _LF and buffer[_AT(p)] != _DOLLAR:
                p += 1
            if buffer[_AT(p)] == _DOLLAR:
                break
            aside[asides, 0], aside[asides, 1], aside[asides, 2], aside[asides, 3] = pos, p, number, n
            asides += 1
            number += 1
            pos = p + 1
            continue
        if (
            (buffer[_AT(p + 1)] | _LOWER) != _O
            or (buffer[_AT(p + 2)] | _LOWER) != _T
            or (buffer[_AT(p + 3)] | _LOWER) != _O
        ):
            break
        p += 4
        while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
            p += 1
        if buffer[_AT(p)] != _SLASH:
            break
        p += 1
        count = 0
        plain = False
        while count < 6:
            while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
                p += 1
            negative = buffer[_AT(p)] == _MINUS
            p += np.int64(negative) | np.int64(buffer[_AT(p)] == _PLUS)  # no branch: signs are hard to predict
            mantissa = np.int64(0)
            first = p
            while np.uint8(buffer[_AT(p)] - _ZERO) < 10:
                mantissa = mantissa * 10 + np.int64(buffer[_AT(p)] - _ZERO)
                p += 1
            digits = p - first
            decimals = 0
            if buffer[_AT(p)] == _POINT:
                p += 1
                first = p
                while np.uint8(buffer[_AT(p)] - _ZERO) < 10:
                    mantissa = mantissa * 10 + np.int64(buffer[_AT(p)] - _ZERO)
                    p += 1
                decimals = p - first
                digits += decimals
            if digits == 0 or digits > 18 or mantissa > _EXACT:
                break
            number_read = mantissa / _POWERS[decimals]
            if number_read > LARGEST:
                break
            value[count] = number_read * (1.0 - 2.0 * negative)
            count += 1
            while buffer[_AT(p)] == _SPACE or buffer[_AT(p)] == _TAB:
                p += 1
            if buffer[_AT(p)] == _COMMA:
                p += 1
                continue
            if buffer[_AT(p)] == _CR:
                p += 1
            plain = buffer[_AT(p)] == _LF
            break
        if not plain or (count != 3 and count != 6):
            break
        if count == 6:
            i, j, k = value[3], value[4], value[5]
            square = i * i + j * j + k * k
            if not square > SMALLEST_SQUARE:
                break
            norm = math.sqrt(square)
            deviation = abs(norm - 1.0)
            if deviation > AXIS_TOLERANCE:
                if off_unit[0] == 0.0:
                    off_unit[1] = number
                off_unit[0] += 1.0
                off_unit[2] = max(off_unit[2], deviation)
            axis_now[0], axis_now[1], axis_now[2] = i / norm, j / norm, k / norm
        for c in range(3):
            tip[n, c] = value[c]
            axis[n, c] = axis_now[c]
        line[n] = number
        n += 1
        number += 1
        pos = p + 1
    cursor[0], cursor[1], cursor[2] = pos, number, n
    return asides
