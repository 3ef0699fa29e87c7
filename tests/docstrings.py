"""What the docstrings of the library leave out, for the tests: arguments of public callables, fields of results."""

import dis
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import parakin as pk

# The floors of the mathematics: their classes are no results, unless the reference names them.
MATHEMATICS = ("parakin.algebra", "parakin.kernels", "parakin.model")
# A line of a docstring, ``name, name : what it is``, or a name in a sentence, in double backticks.
DESCRIBED = re.compile(r"^ *([A-Za-z_]\w*(?:, \w+)*) : |``(\w+)``", re.M)

VARIABLE = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)


def find_described(text: str | None) -> set[str]:
    """Names that a docstring describes."""
    return {name for line, word in DESCRIBED.findall(text or "") for name in (*line.split(", "), word)} - {""}


def list_bases(kind: type) -> list[type]:
    return [base for base in kind.__mro__ if base.__module__ not in ("builtins", "abc", "typing")]


def find_shared(kind: type) -> set[str]:
    """Names that a class and its bases describe: their fields, and arguments that their methods share."""
    return set().union(*(find_described(vars(base).get("__doc__")) for base in list_bases(kind)))


def list_fields(kind: type) -> list[str]:
    """Public fields: those with an annotation, and what a constructor stores."""
    names = [name for base in list_bases(kind) for name in inspect.get_annotations(base)]
    for init in (inspect.unwrap(vars(base)["__init__"]) for base in list_bases(kind) if "__init__" in vars(base)):
        names += [step.argval for step in dis.get_instructions(init) if step.opname == "STORE_ATTR"]
    return [name for name in dict.fromkeys(names) if not name.startswith("_") and not hasattr(Exception, name)]


def list_members(kind: type) -> Iterator[tuple[str, object]]:
    """Public methods and properties as functions."""
    for name, member in (pair for base in list_bases(kind) for pair in vars(base).items()):
        function = getattr(member, "fget", None) or getattr(member, "func", None) or inspect.unwrap(member)
        if not name.startswith("_") and inspect.isfunction(function := getattr(function, "__func__", function)):
            yield name, function


def list_arguments(function: object) -> list[str]:
    parameters = inspect.signature(function).parameters.values()
    return [one.name for one in parameters if one.name not in ("self", "cls") and one.kind not in VARIABLE]


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


def find_unnamed_arguments(function: object) -> list[str]:
    """Arguments that a function's docstring does not name."""
    return [name for name in list_arguments(function) if name not in find_described(function.__doc__)]


def find_undescribed(kind: type) -> list[str]:
    """Fields and members that a class does not describe, and arguments that neither it nor the member names."""
    shared, own = find_shared(kind), list_fields(kind)
    own += list_arguments(kind.__init__) if inspect.isfunction(kind.__init__) else []
    missing = [name for name in own if name not in shared and not isinstance(vars(kind).get(name), property)]
    for name, function in list_members(kind):
        text = inspect.getdoc(getattr(kind, name)) if function.__doc__ is None else function.__doc__
        missing += [name] if not text else []
        known = shared | find_described(text)
        missing += [f"{name}({argument})" for argument in list_arguments(function) if argument not in known]
    return missing
