"""README.md and the commands that pages name: tables, options, files, and the Python that is shown."""

import re
import sys
from pathlib import Path
from typing import get_args

import pytest
from shipped import NAMES, load_shipped

import parakin as pk
from parakin.cli import app
from parakin.controllers import Hardware, Target, load_controller
from parakin.units import name_display_unit

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
import machines_page

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
COMMANDS = {name for name in app if not name.startswith("-")}
OTHERS = ("columns on a circular rail", "two slides on a rail for each leg")  # families of few machines


def read_table(heading, page=README):
    """The rows of the first table below a heading of a page."""
    lines = page.partition(f"# {heading}\n")[2].partition("\n## ")[0].splitlines()
    return [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip("|"))] for line in lines if line.startswith("|")
    ][2:]


def list_options(command):
    """The options of a command, as they are typed."""
    return {name for argument in app[command].assemble_argument_collection() for name in argument.names}


def test_the_table_of_machines_is_that_of_the_command():
    family, named = "", []
    for row in read_table("Machines"):
        if not row[1]:
            family = row[0].strip("*")
            continue
        for name in re.findall(r"`(\w+)`", row[0]):
            machine = load_shipped(name)
            named.append(name)
            own = next(leg for leg in machine.spec.legs).family
            assert own == family or (family == "others" and own in OTHERS), name
            assert row[2].split() == [*machine.axes], name
            counts = re.findall(r"(\d+) (\w+)", row[3])
            assert sum(int(count) for count, _ in counts) == len(machine.joints), name
            turning = sum(int(count) for count, kind in counts if kind in ("turns", "arms", "carriages", "links"))
            assert turning == sum(name_display_unit(drive.unit) == "deg" for drive in machine.drives), name
    assert sorted(named) == sorted(NAMES)


def test_the_page_of_machines_is_what_its_script_writes(monkeypatch):
    page = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    for name in ("rpr3", "five_bar_slides"):
        assert f"{machines_page.measure_workspace(load_shipped(name))} |\n" in page
    monkeypatch.setattr(machines_page, "measure_workspace", lambda machine: "")
    told = machines_page.make_page([load_shipped(name) for name in NAMES])
    assert re.sub(r"\| [\d.]+ to [\d.]+ m. \|$", "|  |", page, flags=re.M) == told


def test_the_table_of_commands_is_that_of_the_command_line():
    first = [re.match(r"`parakin ([\w-]+)", row[0])[1] for row in read_table("Commands")]
    assert {*first} == {*COMMANDS, "--install-completion"}
    assert {name for name in COMMANDS if "--json" not in list_options(name)} == {"studio"}
    for command, text in read_table("Commands"):
        known = list_options(first.pop(0)) if "--install" not in command else {"--install-completion"}
        assert {*re.findall(r"(?<![\w-])--[a-z][a-z-]+", command + text)} <= known, command


def test_the_tables_of_controls_and_cards_are_those_of_the_code():
    joint_programs, linuxcnc = (
        (ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("joint_programs.md", "linuxcnc.md")
    )
    told = {
        row[0].strip("`"): row[2].strip("`")
        for row in read_table("Programs for controls that know no kinematics", joint_programs)
    }
    assert told == {target: load_controller(target).suffix for target in get_args(Target) if target != "linuxcnc"}
    cards = [name for row in read_table("To a real machine", linuxcnc) for name in re.findall(r"`([\w-]+)`", row[0])]
    assert cards[: len(get_args(Hardware))] == [*get_args(Hardware)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_that_a_page_names_have_their_options(page):
    text = page.read_text(encoding="utf-8").replace("\\|", "|")
    commands = re.findall(r"`(?:python -m )?parakin ([^`]+)`", text)
    commands += re.findall(r"^(?:\$ |    )?parakin (.+)$", text, re.M)
    for words in (command.split() for command in commands):
        if words[0].startswith("-") or not words[0][:1].islower():
            continue
        for name in words[0].split("|"):
            assert name in COMMANDS, words
            known = list_options(name)
            for option in re.findall(r"(?<=\s)(--?[a-z][\w-]*)", " ".join(words)):
                assert option in known, words


def test_what_the_readme_links_to_is_there():
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")):
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
            assert target.startswith("http") or (page.parent / target).exists(), f"{page}: {target}"


def test_files_and_names_of_the_library_that_pages_tell_exist():
    folders = ("src", "tests", "docs", "examples", "scripts", "benchmarks", ".ci")
    files = [str(path) for folder in folders for path in (ROOT / folder).rglob("*")]
    for page in PAGES:
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
        for name in re.findall(r"`(?:python )?([\w./-]+(?:\.py|\.js|\.sh|/))(?: [^`]*)?`", text):
            written = re.sub(r"^(NAME|tricept)(?=_screen\.py$)", "", name) != name
            end = "/" + name.rstrip("/")
            assert written or any(file.endswith(end) for file in files) or (ROOT / name).exists(), f"{page}: {name}"
        for name in re.findall(r"\bpk\.(\w+)", text):
            assert name in pk.__all__, f"{page}: {name}"


def test_the_python_of_the_readme_runs(tmp_path, monkeypatch):
    block = re.search(r"```python\n(.*?)```", README, re.S)[1]
    monkeypatch.chdir(tmp_path)
    Path("part.cls").write_text("UNITS/MM\nFEDRAT/1000,MMPM\nGOTO/0,0,-1650,0.1,0,1\nGOTO/10,0,-1650\nFINI\n")
    names = {}
    for line in block.replace("1_000_000", "1_000").replace("q[:100]", "q[:2]").splitlines():
        exec(line, names)
        shown = re.fullmatch(r"(m\.axes, m\.joints)  # (.*)", line)
        assert not shown or eval(shown[1], names) == eval(shown[2])
    assert names["s"].converged.all() and names["job"].posted.first is None
    assert names["w"].volume.inner <= names["w"].volume.outer
