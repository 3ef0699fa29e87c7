"""The report's card of ranges: bars of what each limit allows and what a path uses of it."""

from __future__ import annotations

from html import escape
from math import isfinite
from typing import TYPE_CHECKING

from ...toolpath.posting.range_use import RangeUse
from ..number_format import format_bound, format_value
from .cards import make_card

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Posted


def render_range_card(posted: Posted, uses: list[RangeUse]) -> str:
    joints, rest = uses[: len(posted.machine.joints)], uses[len(posted.machine.joints) :]
    body = f"<h3>Joints</h3><div class=two>{''.join(_render_bar(posted, use) for use in joints)}</div>"
    if rest:
        bars = "".join(_render_bar(posted, use) for use in rest)
        body += f"<h3>Other limits</h3><div class=two>{bars}</div>"
    key = (
        "<span class=key style='background:#dfe7ee;margin-left:0'></span>allowed"
        "<span class=key style='background:var(--used)'></span>used"
        "<span class=key style='background:var(--bad)'></span>used beyond a limit. At the right the least margin"
        " over the path, and where."
    )
    return make_card("Ranges", body, key)


def _render_bar(posted: Posted, use: RangeUse) -> str:
    """Render the used range inside the allowed one, in per cent of both together."""
    ends = [v for v in (use.low, use.high, use.least, use.most) if isfinite(v)]
    if not isfinite(use.low) and use.unit in ("mm", "rad") and isfinite(use.high) and use.high > 0.0:
        ends.append(0.0)  # an angle of a cone, or a distance: what has no lower bound begins at 0
    start, stop = (min(ends), max(ends)) if ends else (0.0, 1.0)
    width = (stop - start) or 1.0
    start, width = start - 0.02 * width, 1.04 * width

    def stretch(style: str, low: float, high: float) -> str:
        left, right = (100.0 * (min(max(v, start), start + width) - start) / width for v in (low, high))
        return f"<i class={style} style='left:{left:.2f}%;width:{right - left:.2f}%'></i>"

    pieces = [stretch("ok", use.low, use.high)]
    if isfinite(use.least):
        if use.most >= use.low and use.least <= use.high:
            pieces.append(stretch("in", max(use.least, use.low), min(use.most, use.high)))
        if use.least < use.low:
            pieces.append(stretch("out", use.least, min(use.most, use.low)))
        if use.most > use.high:
            pieces.append(stretch("out", max(use.least, use.high), use.most))
    if isfinite(use.margin):
        line = int(posted.path.line[use.record])
        slack = (
            f"{format_value(use.margin, use.unit)} left"
            if use.margin >= 0.0
            else f"{format_value(-use.margin, use.unit)} beyond"
        )
        slack += f"<br><small>line {line}</small>"
    else:
        slack = "<small>no limit</small>" if isfinite(use.least) else "<small>never reached</small>"
    lost = f"<br><small>{use.lost:,} can’t be told</small>" if use.lost else ""
    name = escape(use.name).replace(".", ".<wbr>").replace("-", "-<wbr>")
    bad = " bad" if use.margin < 0.0 else ""
    span = f"{format_value(use.least, use.unit).removesuffix(' mm')} … {format_value(use.most, use.unit)}"
    low, high = (format_bound(v, use.unit) if isfinite(v) else "" for v in (use.low, use.high))
    return (
        f"<div class='bar{bad}'><div><b>{name}</b></div><div><div class=scale>{''.join(pieces)}</div>"
        f"<div class=ends><span>{low}</span><span>used {span}</span><span>{high}</span></div></div>"
        f"<div class=slack>{slack}{lost}</div></div>\n"
    )
