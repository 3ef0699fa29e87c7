"""The package's own files, for the tests that read them."""

import ast
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import parakin

ROOT = Path(parakin.__file__).parent


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts)


MODULES = {module_of(path): path for path in sorted(ROOT.rglob("*.py"))}
TREES = {module: ast.parse(path.read_text(encoding="utf-8")) for module, path in MODULES.items()}


@cache
def nodes(module: str) -> list[ast.AST]:
    return list(ast.walk(TREES[module]))


@cache
def functions(module: str) -> list[ast.FunctionDef]:
    return [node for node in nodes(module) if isinstance(node, ast.FunctionDef)]


def for_each(things: Iterable[object]) -> Callable[[Callable[[object], None]], Callable[[], None]]:
    """Make one test of a rule for many things; it lists all that break it."""

    def gather(rule: Callable[[object], None]) -> Callable[[], None]:
        def test() -> None:
            broken = []
            for thing in things:
                try:
                    rule(thing)
                except AssertionError as error:
                    broken.append(f"{thing}: {error}")
            assert not broken, "\n".join(broken)

        return test

    return gather
