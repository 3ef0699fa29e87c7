"""The pages of docs/: what they show happens, what they name exists, and Sphinx makes them without a warning."""

import doctest
import re
import shlex
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

import parakin as pk
from parakin.cli import main
from parakin.commands.design_problem import read_design_problem
from parakin.description import machine_file
from parakin.description.groups import LegGroup
from parakin.description.sections import CirclePoints, LimitsSection
from parakin.model.legs import KINDS

DOCS = Path(__file__).parents[1] / "docs"
BLOCK = re.compile(r"^```(?:\{code-block\} )?(\w+)\n(?::caption: (\S+)\n)?(.*?)^```$", re.M | re.S)
FILE, COMMANDS, PYTHON = "file", "commands", "python"


# Where the parts of files stand that pages show: the machine, whether it has these lines itself; the problem's file.
PARTS = {
    "forces.md": [("orthoglide", False)],
    "integrator.md": [("tricept", False)],
    "machine_file.md": [("tricept", True), ("sprint_z3", True), ("orthoglide", False)],
    "designer.md": ["glide.yaml", "glide.yaml", None, None],
}


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


def list_parts(folder):
    """The parts of files that a folder's pages show, by page."""
    pages = {page.name: BLOCK.findall(page.read_text(encoding="utf-8")) for page in folder.rglob("*.md")}
    parts = {
        page: [text for kind, caption, text in blocks if kind == "yaml" and not caption]
        for page, blocks in pages.items()
    }
    return {page: texts for page, texts in parts.items() if texts}


def test_the_parts_of_machine_files_that_pages_show_are_read(tmp_path):
    shown = list_parts(DOCS)
    assert {page: len(texts) for page, texts in shown.items()} == {page: len(where) for page, where in PARTS.items()}
    for page in ("forces.md", "integrator.md", "machine_file.md"):
        for part, (name, is_its_own) in zip(shown[page], PARTS[page], strict=True):
            source = Path(machine_file.__file__).parents[1] / "machines" / f"{name}.yaml"
            before, keys = (yaml.safe_load(text) for text in (source.read_text(encoding="utf-8"), part))
            of_legs = {key: value for key, value in keys.items() if key in LegGroup.model_fields}
            after = {**before, **{key: value for key, value in keys.items() if key not in of_legs}}
            after["legs"] = {**before["legs"], **of_legs}
            (tmp_path / "m.yaml").write_text(yaml.safe_dump(after, sort_keys=False), encoding="utf-8")
            told = pk.load(tmp_path / "m.yaml").format_yaml()
            assert (told == pk.load(name).format_yaml()) == is_its_own, part


def test_the_parts_of_design_problems_that_a_page_shows_are_read(tmp_path):
    page = (DOCS / "tutorials" / "designer.md").read_text(encoding="utf-8")
    files = {name: text for _, name, text in BLOCK.findall(page) if name}
    (tmp_path / "pocket.apt").write_text(files["pocket.apt"], encoding="utf-8")
    for part, name in zip(list_parts(DOCS)["designer.md"], PARTS["designer.md"], strict=True):
        whole = {**yaml.safe_load(files[name] if name else "{}"), **yaml.safe_load(part)}
        (tmp_path / "problem.yaml").write_text(yaml.safe_dump(whole, sort_keys=False), encoding="utf-8")
        problem = read_design_problem(tmp_path / "problem.yaml")
        assert {*problem.bounds} == {*whole.get("bounds", {})}


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
