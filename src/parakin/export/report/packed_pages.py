"""Whole pages packed into one page, which shows them in a frame: see ``page_frame.js``."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from zlib import compress


def render_page_frame(pages: Sequence[str], title: str) -> str:
    """Render a frame that shows one of the pages, and the pages as compressed text; each line of them stands once.

    Pages of alike machines share nearly all of their lines, so each beyond the first one takes a few kB.
    """
    lines: dict[str, int] = {}
    numbered = [[lines.setdefault(line, len(lines)) for line in page.split("\n")] for page in pages]
    data = json.dumps({"lines": list(lines), "pages": numbered}, separators=(",", ":"))
    packed = b64encode(compress(data.encode("ascii"), 9)).decode("ascii")
    frame = f'<iframe class=page title="{escape(title)}"></iframe>\n'
    return f'{frame}<script type="text/plain" id="pages">{packed}</script>\n'
