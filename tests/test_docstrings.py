"""The docstrings of the library: each argument of a public callable is named, each field of a result is described."""

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from sources import for_each

import parakin as pk

# The floors of the mathematics: their classes are no results, unless the reference names them.
MATHEMATICS = ("parakin.algebra", "parakin.kernels", "parakin.model")
# A line of a docstring, ``name, name : what it is``, or a name in a sentence, in double backticks.
DESCRIBED = re.compile(r"^ *([A-Za-z_]\w*(?:, \w+)*) : |``(\w+)``", re.M)


def find_described(text: str | None) -> set[str]:
    """Names that a docstring describes."""
    return {name for line, word in DESCRIBED.findall(text or "") for name in (*line.split(", "), word)} - {""}


def list_bases(kind: type) -> list[type]:
    return [base for base in kind.__mro__ if base.__module__ not in ("builtins", "abc", "typing")]


def find_shared(kind: type) -> set[str]:
    """Names that a class and its bases describe: their fields, and arguments that their methods share."""
    return set().union(*(find_described(vars(base).get("__doc__")) for base in list_bases(kind)))


def list_fields(kind: type) -> list[str]:
    return [name for base in list_bases(kind) for name in inspect.get_annotations(base) if not name.startswith("_")]


def list_members(kind: type) -> Iterator[tuple[str, object]]:
    """Public methods and properties as functions."""
    for name, member in (pair for base in list_bases(kind) for pair in vars(base).items()):
        function = getattr(member, "fget", None) or getattr(member, "func", None) or inspect.unwrap(member)
        if not name.startswith("_") and inspect.isfunction(function := getattr(function, "__func__", function)):
            yield name, function


def list_arguments(function: object) -> list[str]:
    return [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]


def list_named(owner: object, annotations: dict[str, object]) -> list[object]:
    """What the words of annotations stand for where their owner is written."""
    names = vars(inspect.getmodule(owner))
    words = {word for hint in annotations.values() for word in re.findall(r"\w+", str(hint))}
    return [names.get(word, vars(pk).get(word)) for word in words]


def list_answers(function: object) -> list[object]:
    return list_named(function, {"": function.__annotations__.get("return")})


REFERENCE = Path(__file__).parents[1] / "docs" / "reference" / "python.md"
NAMES = re.findall(r":: (parakin[\w.]*)\.(\w+)$", REFERENCE.read_text(encoding="utf-8"), re.M)
PUBLIC = [getattr(import_module(module), name) for module, name in NAMES]
FUNCTIONS = [inspect.unwrap(thing) for thing in PUBLIC if not inspect.isclass(thing)]


def is_result(thing: object) -> bool:
    if not inspect.isclass(thing) or thing.__name__.startswith("_") or not thing.__module__.startswith("parakin."):
        return False
    return thing in PUBLIC or not thing.__module__.startswith(MATHEMATICS)


def collect_classes() -> list[type]:
    """Collect the classes of the reference, and all that functions, fields and methods lead to."""
    waiting = [*PUBLIC, *(answer for function in FUNCTIONS for answer in list_answers(function))]
    kinds: list[type] = []
    while waiting:
        kind = waiting.pop()
        if is_result(kind) and kind not in kinds:
            kinds.append(kind)
            waiting += (answer for _, function in list_members(kind) for answer in list_answers(function))
            waiting += (named for base in list_bases(kind) for named in list_named(base, inspect.get_annotations(base)))
    return kinds


CLASSES = collect_classes()


def check_function(function: object) -> None:
    unnamed = [name for name in list_arguments(function) if name not in find_described(function.__doc__)]
    assert not unnamed, unnamed


def check_class(kind: type) -> None:
    shared, missing = find_shared(kind), list[str]()
    own = list_fields(kind)
    if not own and "__init__" in vars(kind):
        own = list_arguments(kind.__init__)
    missing += [name for name in own if name not in shared and not isinstance(vars(kind).get(name), property)]
    for name, function in list_members(kind):
        text = inspect.getdoc(getattr(kind, name)) if function.__doc__ is None else function.__doc__
        missing += [name] if not text else []
        known = shared | find_described(text)
        missing += [f"{name}({argument})" for argument in list_arguments(function) if argument not in known]
    assert not missing, missing


test_functions_name_their_arguments = for_each(FUNCTIONS)(check_function)
test_classes_describe_fields_and_arguments = for_each(CLASSES)(check_class)


def test_what_users_get_is_looked_at():
    names = {kind.__name__ for kind in CLASSES}
    assert {"Machine", "Family", "FamilyRates", "Posted", "Offence", "Performance", "Drive", "Setpoints"} <= names
    assert len(names) > 80


def test_what_is_missing_is_seen():
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

    messages = []
    for check, thing in ((check_function, answer), (check_class, Rows)):
        try:
            check(thing)
        except AssertionError as error:
            messages.append(str(error).splitlines()[0])
    assert messages == ["['mode']", "['mode', 'take(count)', 'first']"]
