"""The pages of docs/: what they show happens, what they name exists, and Sphinx makes them without a warning."""

import doctest
import re
import shlex
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

import parakin as pk
from parakin.cli import main
from parakin.description import machine_file
from parakin.description.groups import LegGroup
from parakin.description.sections import CirclePoints, LimitsSection
from parakin.model.legs import KINDS

DOCS = Path(__file__).parents[1] / "docs"
BLOCK = re.compile(r"^```(?:\{code-block\} )?(\w+)\n(?::caption: (\S+)\n)?(.*?)^```$", re.M | re.S)
FILE, COMMANDS, PYTHON = "file", "commands", "python"


def read_blocks(page):
    """The blocks of a page that are tested: files to write, commands with their output, Python."""
    for language, caption, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if caption:
            yield FILE, (caption, text)
        elif language == "console":
            yield COMMANDS, text
        elif language == "pycon":
            yield PYTHON, text


PAGES = [page for page in sorted(DOCS.rglob("*.md")) if any(kind != FILE for kind, _ in read_blocks(page))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_a_page_shows_is_what_happens(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for kind, content in read_blocks(page):
        if kind == FILE:
            Path(content[0]).write_text(content[1], encoding="utf-8")
        elif kind == COMMANDS:
            check_commands(content, capsys)
        else:
            check_python(content, page.name, names)


def check_commands(block, capsys):
    """Run every command of a block; lines of it that are ... stand for any lines, ... in a line for any text."""
    for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
        line, _, shown = part.partition("\n")
        words = shlex.split(line)
        assert words[0] == "parakin", line
        main(words[1:])
        captured = capsys.readouterr()
        said = "".join(line for line in captured.err.splitlines(True) if not line.startswith("compiling the kernels"))
        printed = strip_lines(said + captured.out)
        pattern = "".join(make_pattern(shown_line) for shown_line in strip_lines(shown).splitlines())
        assert re.fullmatch(pattern, printed), f"$ {line}\n{printed}"


def make_pattern(line):
    return r"(?:.*\n)*?" if line == "..." else re.escape(line).replace(r"\.\.\.", ".*?") + "\n"


def strip_lines(text):
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


def check_python(block, name, names):
    test = doctest.DocTestParser().get_doctest(block, names, name, name, 0)
    failures = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    runner.run(test, out=failures.append, clear_globs=False)
    names.update(test.globs)
    assert not failures, "".join(failures)


def test_every_public_name_is_in_the_reference():
    page = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^\.\. auto\w+:: parakin\.(\w+)$", page, re.M))
    assert named == {name for name in pk.__all__ if not name.startswith("__")}


def test_every_key_of_a_machine_file_is_in_the_reference():
    page = (DOCS / "reference" / "machine_file.md").read_text(encoding="utf-8")
    keys = {*machine_file._MachineSection.model_fields, *LegGroup.model_fields}
    keys |= {*CirclePoints.model_fields, *LimitsSection.model_fields}
    assert not {key for key in keys if f"`{key}`" not in page}
    for kind, leg in KINDS.items():
        section = page.partition(f"### `{kind}`")[2].partition("\n### ")[0]
        assert section, kind
        names = {field.name for field in fields(leg)} - {"drives", "platform"}
        assert not {name for name in names if f"`{name}`" not in section}, kind
        assert (DOCS / "pictures" / "legs" / f"{kind}.svg").is_file()


def test_sphinx_makes_the_pages_without_a_warning(tmp_path):
    command = [
        Path(sys.executable).with_name("sphinx-build"),
        "-W",
        "--keep-going",
        "-q",
        "-D",
        "live_pages=0",
        "-b",
        "html",
        DOCS,
        tmp_path,
    ]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    commands = (tmp_path / "reference" / "commands.html").read_text(encoding="utf-8")
    assert "parakin inverse [OPTIONS] NAME" in re.sub(r"<[^>]+>", "", commands)
