"""The fast reader of G-code: runs of plain lines, points and feeds, straight from bytes.

It accepts only what the block reader reads the same way; the first line that is anything else ends the run.
"""

import math
import re

from .codes import G0, G1
from .motion import STILL, GcodeMotion

_NUMBER = rb"([+-]?(?:\d{1,9}(?:\.\d{0,15})?|\.\d{1,15}))"  # stays below the largest number that is read
_BLANKS = rb"[ \t]{0,99}"  # so few that no line is too long
_LINE = re.compile(
    rb"%b(?:[Nn]\d{1,9}%b)?(?:[Gg]0?([01])%b)?" % (_BLANKS, _BLANKS, _BLANKS)
    + b"".join(rb"(?:[%c%c]%b%b)?" % (c, c + 32, _NUMBER, _BLANKS) for c in b"XYZABCF")
    + rb"\r?"
)


def read_plain_lines(lines: list[bytes], at: int, first: int, motion: GcodeMotion) -> int:
    """Read plain lines from ``lines[at]`` on, up to the first one that is not; return its index.

    first : the file's line number of ``lines[0]``
    """
    mode, feed, rate, scale, rpm = motion.mode, motion.feed, motion.rate, motion.scale, motion.rpm
    x, y, z, a, b, c = motion.here
    has_a, has_b, has_c = motion.plain_turns
    incremental, inverse_time = motion.incremental, motion.inverse_time
    add, fullmatch, nan = motion.records.fresh.extend, _LINE.fullmatch, math.nan
    index = at
    for index in range(at, len(lines)):
        match = fullmatch(lines[index])
        if match is None:
            break
        if match.lastindex is None:
            continue  # nothing, or a line number alone
        code, tx, ty, tz, ta, tb, tc, tf = match.groups()
        now = mode if code is None else G0 if code == b"0" else G1
        if now is None or now > G1:
            break
        turning = ta is not None or tb is not None or tc is not None
        if turning:
            if (ta is not None and not has_a) or (tb is not None and not has_b) or (tc is not None and not has_c):
                break
        elif tx is None and ty is None and tz is None:
            break
        new_rate, new_feed, seconds = rate, feed, nan
        if tf is not None:
            value = float(tf)
            if not value > 0.0 or (inverse_time and now == G0):
                break
            if inverse_time:
                seconds = 60.0 / value
            else:
                new_rate, new_feed = value, value * scale
        elif inverse_time and now == G1:
            break
        if now == G1 and not (inverse_time or new_rate > 0.0):
            break
        nx = x if tx is None else float(tx) * scale
        ny = y if ty is None else float(ty) * scale
        nz = z if tz is None else float(tz) * scale
        na, nb, nc = a, b, c
        if turning:
            na = a if ta is None else float(ta)
            nb = b if tb is None else float(tb)
            nc = c if tc is None else float(tc)
        if incremental:
            if x != x or y != y or z != z:
                break
            nx, ny, nz = (x if tx is None else nx + x), (y if ty is None else ny + y), (z if tz is None else nz + z)
            if turning:
                na, nb, nc = (a if ta is None else na + a), (b if tb is None else nb + b), (c if tc is None else nc + c)
        if turning and now == G1 and not inverse_time:
            moves = abs(nx - x) > STILL or abs(ny - y) > STILL or abs(nz - z) > STILL
            degrees = 0.0 if moves else math.dist((a, b, c), (na, nb, nc))
            if degrees > 0.0:
                seconds = 60.0 * degrees / new_rate
        mode, rate, feed = now, new_rate, new_feed
        x, y, z, a, b, c = nx, ny, nz, na, nb, nc
        add((x, y, z, a, b, c, nan if inverse_time else feed, seconds, rpm, now == G0, first + index))
    else:
        index = len(lines)
    motion.mode, motion.rate, motion.feed = mode, rate, feed
    motion.here = [x, y, z, a, b, c]
    return index
