"""docs/files.md is what scripts/reading_page.py writes from the readers' tables."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_page_is_current():
    check = subprocess.run([sys.executable, str(ROOT / "scripts/reading_page.py"), "--check"], check=False)
    assert check.returncode == 0, "run python scripts/reading_page.py"


def test_it_names_every_word_and_code():
    from parakin.toolpath.reading.cl.words import INFORMING, REFUSED, WORDS
    from parakin.toolpath.reading.gcode.codes import G_GROUPS, M_GROUPS, format_g_code

    page = (ROOT / "docs/files.md").read_text(encoding="utf-8")
    codes = [format_g_code(code) for group in G_GROUPS.values() for code in group]
    codes += [f"M{code}" for group in M_GROUPS.values() for code in group]
    assert not [word for word in (*WORDS, *REFUSED, *INFORMING, *codes) if f"`{word}`" not in page]
    assert "docs/files.md" in (ROOT / "README.md").read_text(encoding="utf-8")
