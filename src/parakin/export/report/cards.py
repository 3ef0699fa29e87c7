"""The report's cards."""

from __future__ import annotations

from html import escape


def make_card(heading: str, body: str, sub: str = "") -> str:
    """Make a card; ``heading`` is text, ``body`` and the line ``sub`` under the heading are HTML."""
    under = f"<p class=sub>{sub}</p>\n" if sub else ""
    return f"<section class=card><h2>{escape(heading)}</h2>\n{under}{body}</section>\n"


def make_fact_table(rows: list[tuple[str, str]]) -> str:
    """Make a table of names and values, both text."""
    body = "".join(f"<tr><td class=k>{escape(key)}</td><td>{escape(value)}</td></tr>\n" for key, value in rows)
    return f"<table>{body}</table>"
