"""Format tables of numbers as decimal text, fast: fixed digits, without trailing zeros."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, Flags, Indices
from ...kernels.compiling import njit

WIDEST = 26  # bytes a number takes at most, its separator included
_COMMA, _MINUS, _POINT, _LF, _ZERO = (ord(c) for c in ",-.\n0")
_LARGEST = 9.0e18  # a scaled value as large doesn't fit into an integer
_HUNDRED, _E4, _E6, _E8 = (np.uint64(10**n) for n in (2, 4, 6, 8))
_PAIRS = np.frombuffer("".join(f"{i:02}" for i in range(100)).encode(), np.uint8)


@njit(cache=True, nogil=True, inline="always")
def _format_integer(value: Any, out: NDArray[np.uint8], at: Any) -> Any:
    """Write a natural number from ``at`` on; return its end."""
    length = 1
    bound = np.uint64(10)
    while length < 19 and value >= bound:
        length += 1
        bound *= np.uint64(10)
    p = at + length
    while p - at >= 2:
        rest = value // _HUNDRED
        pair = np.int64(value - rest * _HUNDRED)
        out[p - 1] = _PAIRS[2 * pair + 1]
        out[p - 2] = _PAIRS[2 * pair]
        value = rest
        p -= 2
    if p > at:
        out[at] = np.uint8(_ZERO + np.int64(value))
    return at + length


@njit(cache=True, nogil=True, inline="always")
def _format_decimal(value: Any, scale: Any, digits: Any, out: NDArray[np.uint8], at: Any) -> Any:
    """Write the integer ``value·scale`` with a point before its last 4, 6 or 8 ``digits``; nothing for NaN."""
    scaled = np.rint(value * scale)
    size = abs(scaled)
    if not size < _LARGEST:
        return at
    whole = np.uint64(size)
    if digits == 6:  # divisors the compiler knows: multiplications instead of divisions
        natural = whole // _E6
        rest = whole - natural * _E6
    elif digits == 8:
        natural = whole // _E8
        rest = whole - natural * _E8
    else:
        natural = whole // _E4
        rest = whole - natural * _E4
    out[at] = _MINUS
    at = _format_integer(natural, out, at + np.int64(scaled < 0.0))
    if rest == 0:
        return at
    out[at] = _POINT
    p = at + 1 + digits
    while p > at + 1:
        above = rest // _HUNDRED
        pair = np.int64(rest - above * _HUNDRED)
        out[p - 1] = _PAIRS[2 * pair + 1]
        out[p - 2] = _PAIRS[2 * pair]
        rest = above
        p -= 2
    p = at + digits
    while out[p] == _ZERO:
        p -= 1
    return p + 1


class JointColumns(NamedTuple):
    """The columns of a joint table, as in :class:`~parakin.toolpath.posting.posted.Posted`."""

    lines: Indices
    poses: Array
    joints: Array
    feed: Array
    rapid: Flags
    broken: Indices


class NumberFormat(NamedTuple):
    """For each number of a row, what makes the printed integer, and how many of its digits are decimals."""

    scales: Array
    digits: Indices


class LimitNames(NamedTuple):
    """The limits' names one after another, as bytes, and where each begins and the last ends."""

    text: NDArray[np.uint8]
    starts: Indices


@njit(cache=True, nogil=True)
def format_joint_rows(
    first: int, last: int, columns: JointColumns, form: NumberFormat, names: LimitNames, out: NDArray[np.uint8]
) -> int:
    """Write rows ``first`` to ``last`` of a joint table as CSV into ``out``; return how many bytes.

    form : of poses, joints and feed
    """
    lines, poses, joints, feed = columns.lines, columns.poses, columns.joints, columns.feed
    rapid, broken = columns.rapid, columns.broken
    scales, digits = form.scales, form.digits
    text, starts = names.text, names.starts
    at = 0
    axes = poses.shape[1]
    moving = axes + joints.shape[1]
    for n in range(first, last):
        at = _format_integer(np.uint64(n), out, at)
        out[at] = _COMMA
        at = _format_integer(np.uint64(lines[n]), out, at + 1)
        out[at] = _COMMA
        at += 1
        for c in range(axes):
            at = _format_decimal(poses[n, c], scales[c], digits[c], out, at)
            out[at] = _COMMA
            at += 1
        for c in range(axes, moving):
            at = _format_decimal(joints[n, c - axes], scales[c], digits[c], out, at)
            out[at] = _COMMA
            at += 1
        at = _format_decimal(feed[n], scales[moving], digits[moving], out, at)
        out[at] = _COMMA
        out[at + 1] = _ZERO + rapid[n]
        out[at + 2] = _COMMA
        at += 3
        if broken[n] > 0:
            for c in range(starts[broken[n] - 1], starts[broken[n]]):
                out[at] = text[c]
                at += 1
        out[at] = _LF
        at += 1
    return at


@njit(cache=True, nogil=True)
def format_cells(values: Array, scales: Array, digits: Indices, out: NDArray[np.uint8]) -> int:
    """Write a table of numbers (rows, columns) as CSV into ``out``; return how many bytes."""
    at = 0
    last = values.shape[1] - 1
    for n in range(len(values)):
        for c in range(last + 1):
            at = _format_decimal(values[n, c], scales[c], digits[c], out, at)
            out[at] = _COMMA if c < last else _LF
            at += 1
    return at
