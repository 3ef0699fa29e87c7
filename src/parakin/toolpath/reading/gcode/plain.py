"""Runs of plain lines, straight from bytes: points and feeds, nearly all of a large program.

Only what the block reader would read the same way is taken; the first line that is anything else ends the run.
"""

import math
import re

from .motion import STILL, GcodeMotion

_NUMBER = rb"([+-]?(?:\d{1,9}(?:\.\d{0,15})?|\.\d{1,15}))"  # stays below the largest number that is read
_BLANKS = rb"[ \t]{0,99}"  # so few that no line is too long
_LINE = re.compile(
    rb"%b(?:[Nn]\d{1,9}%b)?(?:[Gg]0?([01])%b)?" % (_BLANKS, _BLANKS, _BLANKS)
    + b"".join(rb"(?:[%c%c]%b%b)?" % (c, c + 32, _NUMBER, _BLANKS) for c in b"XYZABCF")
    + rb"\r?"
)


def plain_run(lines: list[bytes], at: int, first: int, motion: GcodeMotion) -> int:
    """Read plain lines from ``lines[at]`` on; returns the index behind the last one. ``first`` is the file's line
    number of ``lines[0]``.
    """
    mode, feed, rate, scale, rpm = motion.mode, motion.feed, motion.rate, motion.scale, motion.rpm
    x, y, z, a, b, c = motion.here
    has_a, has_b, has_c = motion.turned
    incremental, inverse_time = motion.incremental, motion.inverse_time
    add, fullmatch, nan = motion.rows.fresh.extend, _LINE.fullmatch, math.nan
    index = at
    for index in range(at, len(lines)):
        found = fullmatch(lines[index])
        if found is None:
            break
        if found.lastindex is None:
            continue  # nothing, or a line number alone
        code, tx, ty, tz, ta, tb, tc, tf = found.groups()
        now = mode if code is None else 0 if code == b"0" else 10
        if now is None or now > 10:
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
            if not value > 0.0 or (inverse_time and now == 0):
                break
            if inverse_time:
                seconds = 60.0 / value
            else:
                new_rate, new_feed = value, value * scale
        elif inverse_time and now == 10:
            break
        if now == 10 and not (inverse_time or new_rate > 0.0):
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
            if tx is not None:
                nx += x
            if ty is not None:
                ny += y
            if tz is not None:
                nz += z
            if turning:
                na = a if ta is None else na + a
                nb = b if tb is None else nb + b
                nc = c if tc is None else nc + c
        if (
            turning
            and now == 10
            and not (inverse_time or abs(nx - x) > STILL or abs(ny - y) > STILL or abs(nz - z) > STILL)
        ):
            degrees = math.dist((a, b, c), (na, nb, nc))
            if degrees > 0.0:
                seconds = 60.0 * degrees / new_rate
        mode, rate, feed = now, new_rate, new_feed
        x, y, z, a, b, c = nx, ny, nz, na, nb, nc
        add((x, y, z, a, b, c, nan if inverse_time else feed, seconds, rpm, now == 0, first + index))
    else:
        index = len(lines)
    motion.mode, motion.rate, motion.feed = mode, rate, feed
    motion.here = [x, y, z, a, b, c]
    return index
