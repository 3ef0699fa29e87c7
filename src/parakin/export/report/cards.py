"""The report's cards, and how it words counts and times."""

from __future__ import annotations

from html import escape


def card(heading: str, body: str, sub: str = "") -> str:
    """A card; ``heading`` is text, ``body`` and the line ``sub`` under the heading are HTML."""
    under = f"<p class=sub>{sub}</p>\n" if sub else ""
    return f"<section class=card><h2>{escape(heading)}</h2>\n{under}{body}</section>\n"


def counted(count: int, one: str) -> str:
    """``1 record``, ``5,011 records``."""
    return f"{count:,} {one}{'' if count == 1 else 's'}"


def duration(seconds: float) -> str:
    """``12.3 s``, ``4 min 34 s``, ``1 h 0 min 5 s``."""
    whole = round(seconds, 1) if seconds < 60.0 else round(seconds)
    if whole < 60:
        return f"{whole:g} s"
    hours, rest = divmod(int(whole), 3600)
    return f"{f'{hours:,} h ' if hours else ''}{rest // 60} min {rest % 60} s"


def facts(rows: list[tuple[str, str]]) -> str:
    """A table of names and values, both text."""
    body = "".join(f"<tr><td class=k>{escape(key)}</td><td>{escape(value)}</td></tr>\n" for key, value in rows)
    return f"<table>{body}</table>"
