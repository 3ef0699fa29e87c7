"""The house rules that a reader can see: sizes of files, names, plain words, no dead code, docstrings that tell all."""

import ast
import re
from collections import Counter
from typing import NamedTuple

import pytest
from docstrings import CLASSES, FUNCTIONS, find_undescribed, find_unnamed_arguments
from sources import MODULES, ROOT, TREES, for_each, functions

SOURCES = sorted(path for ending in ("py", "c", "js", "css") for path in ROOT.rglob(f"*.{ending}"))


@for_each(SOURCES)
def test_no_file_is_longer_than_400_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


def test_a_file_name_stands_once():
    """But in folders side by side, which do the same for two things; a command or export may be named as its room."""
    places = {}
    for path in SOURCES:
        place = path.relative_to(ROOT)
        if path.stem != "__init__" and place.parts[0] not in ("commands", "export"):
            places.setdefault(path.name, set()).add(place.parent)
    assert not [name for name, folders in places.items() if len(folders) > 1 and len({f.parent for f in folders}) > 1]


# Words that say nothing of what a name holds; options have them where people type or read them.
EMPTY = {"asked", "found", "held", "part", "parts", "some", "stuff", "taken", "thing", "things", "told"}
# Words that the glossary of docs/design.md replaced.
REPLACED = {
    "course",
    "gentle",
    "island",
    "islands",
    "law",
    "neighbours",
    "strays",
    "swiftness",
    "tube",
    "uphill",
}
OPTIONS = {("workspaces.certified.region", "some")}


def names_given(tree: ast.AST) -> set[str]:
    """Names that a file gives to parameters, locals, functions and classes."""
    names = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    names |= {n.arg for n in ast.walk(tree) if isinstance(n, ast.arg)}
    return names | {n.name for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.ClassDef))}


@for_each([m for m in MODULES if not m.startswith("commands.")])
def test_names_say_what_they_hold(module):
    names = names_given(TREES[module])
    assert not {name for name in names & (EMPTY | REPLACED) if (module, name) not in OPTIONS}


def test_names_given_are_seen():
    tree = ast.parse("def told(part):\n    for held in part:\n        found, x = held\n")
    assert names_given(tree) == {"told", "part", "held", "found", "x"}


ARCHAIC = re.compile(
    r"\b(albeit|hitherto|lest|noughts?|that is none|thence|thereof|whence|wherein|whilst)\b", re.IGNORECASE
)


@for_each(SOURCES)
def test_words_are_plain(path):
    assert not ARCHAIC.findall(path.read_text(encoding="utf-8"))


def definitions(module: str) -> list[str]:
    """What a file defines and calls by name: functions and classes without a decorator, and constants."""
    tree = TREES[module]
    nodes = [n for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.ClassDef))]
    names = [n.name for n in nodes if not any("validator" in ast.unparse(d) for d in n.decorator_list)]
    for node in tree.body:
        if isinstance(node, ast.Assign):
            names += [target.id for target in node.targets if isinstance(target, ast.Name)]
    return [name for name in names if not name.startswith("__")]


# Called by others: Python, Numba, a terminal's key bindings; found by their folder; for the page of scripts/.
FROM_OUTSIDE = {"_repr_html_", "_load_data", "_save_data", "on_end", "on_start", "GROUP_TITLES"}


def test_nothing_stands_for_the_tests_alone():
    words = Counter()
    for path in SOURCES:
        words.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    names = {name for module in MODULES if not module.startswith("model.legs.") for name in definitions(module)}
    assert len(names) > 1000
    assert not {name for name in names if words[name] == 1} - FROM_OUTSIDE


@for_each(FUNCTIONS)
def test_functions_name_their_arguments(function):
    assert not find_unnamed_arguments(function)


@for_each(CLASSES)
def test_classes_describe_their_fields_and_name_arguments(kind):
    assert not find_undescribed(kind)


def test_what_users_get_is_looked_at():
    names = {kind.__name__ for kind in CLASSES}
    assert {"Machine", "Family", "FamilyRates", "Posted", "Offence", "Performance", "Drive", "Setpoints"} <= names
    assert len(names) > 100


def test_what_a_docstring_lacks_is_seen():
    def answer(poses, mode):
        """Answer for ``poses``."""

    class Rows(NamedTuple):
        """Rows.

        poses : (n, axes)
        """

        poses: int
        mode: str

        def take(self, count, poses):
            """Take some of the count."""

        @property
        def first(self):
            return self.poses

    assert find_unnamed_arguments(answer) == ["mode"]
    assert find_undescribed(Rows) == ["mode", "take(count)", "first"]


def test_all_that_break_a_rule_are_listed():
    @for_each([1, 2, 3])
    def rule(number):
        assert number == 2, "odd"

    with pytest.raises(AssertionError) as raised:
        rule()
    assert [line.split(":")[0] for line in str(raised.value).splitlines() if "odd" in line] == ["1", "3"]


def test_functions_are_seen():
    assert {"solve_inverse"} == {function.name for function in functions("kinematics.inverse")}
