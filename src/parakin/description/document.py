"""Read YAML files as plain text, lists and mappings that remember their lines.

Nothing is interpreted here: every scalar stays the text that the user wrote, so ``no``, ``1e400`` and ``12:30`` hold no
surprises. The reader of a value decides what it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from ..errors import CONTROL_CHARACTER, InputError, quote

MACHINE = "a machine's description"  # what is expected in a file, for messages
_LONGEST = 100_000  # bytes
_DEEPEST = 16  # levels; aliases can make a cycle
_MOST = 20_000  # values; aliases of aliases grow exponentially
_TAGS = {f"tag:yaml.org,2002:{t}" for t in ("map", "seq", "str", "int", "float", "bool", "null", "timestamp", "merge")}


class YamlText(str):
    """A scalar as written, with its line, and where in the file's text it stands: the first character and the end."""

    line: int
    place: slice

    def __new__(cls, text: str, line: int, place: slice | None = None) -> YamlText:
        self = super().__new__(cls, text)
        self.line, self.place = line, place or slice(0, 0)
        return self


class YamlList(list[Any]):
    """A list; its items are :class:`YamlText`, :class:`YamlList` and :class:`YamlMap`."""

    def __init__(self, items: list[Any], line: int):
        super().__init__(items)
        self.line = line


class YamlMap(dict[Any, Any]):
    """A mapping with keys of :class:`YamlText`; a value's line is that of its key, where a reader looks for it."""

    def __init__(self, items: Mapping[YamlText, Any], line: int):
        super().__init__(items)
        self.line = line


Value: TypeAlias = YamlText | YamlList | YamlMap


def read_document(path: Path, source: str, what: str = MACHINE) -> tuple[Value, list[InputError]]:
    """Read a YAML file's only document; return it with the errors that leave the rest readable (keys written twice).

    what : is expected in it, for messages

    Raises :class:`InputError` if there is no such document.
    """
    return parse_document(read_text(path, source), source, what)


def read_text(path: Path, source: str) -> str:
    """Read a YAML file as text; raises :class:`InputError` if it is none, or too long."""
    try:
        with path.open("rb") as file:
            content = file.read(_LONGEST + 1)
    except (OSError, ValueError) as error:  # ValueError: a zero character in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"can't read this file: {reason}", source) from None
    if len(content) > _LONGEST:
        raise InputError(f"longer than {_LONGEST} bytes, expected a YAML file of some twenty lines", source)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError("not a text file in UTF-8, expected YAML", source, line) from None


def parse_document(text: str, source: str, what: str = MACHINE) -> tuple[Value, list[InputError]]:
    """Parse the text of a YAML file; as :func:`read_document`."""
    document, errors = _parse_text(text, source, what)
    return document, list(errors)


@lru_cache(maxsize=8)  # a machine's file is read again for every change of its sizes
def _parse_text(text: str, source: str, what: str) -> tuple[Value, tuple[InputError, ...]]:
    reader = YAML(typ="safe", pure=True)
    reader.Composer = _BoundedComposer
    try:
        node = reader.compose(text)
    except _NestingError as error:
        raise InputError("nested too deeply", source, error.line) from None
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise InputError("holds a character that YAML does not allow, expected text", source, line) from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = " ".join(str(error.problem or error.context or "syntax error").split())
        raise InputError(f"not valid YAML: {problem}", source, mark.line + 1 if mark else None) from None
    # ruamel raises errors of its own code on some malformed directives and escapes.
    except (YAMLError, ValueError, LookupError, TypeError, AttributeError, AssertionError, OverflowError):
        raise InputError("not valid YAML", source) from None
    if node is None:
        raise InputError(f"empty, expected {what}", source, 1)
    builder = _DocumentBuilder(source)
    return builder.build(node, node.start_mark.line + 1, 0), tuple(builder.errors)


class _NestingError(Exception):
    """A node is nested too deeply, in a line."""

    def __init__(self, line: int):
        super().__init__(line)
        self.line = line


class _BoundedComposer(Composer):
    """A composer of nodes that are not nested too deeply, so that a page of brackets takes no time."""

    def __init__(self, loader: Any = None):
        super().__init__(loader)
        self.warn_double_anchors = False  # YAML lets an anchor be set anew
        self._nesting = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self._nesting > _DEEPEST:
            raise _NestingError(self.parser.peek_event().start_mark.line + 1)
        self._nesting += 1
        node = super().compose_node(parent, index)
        self._nesting -= 1
        return node


class _DocumentBuilder:
    """Build the document from ruamel's nodes, within bounds for depth and number of values."""

    def __init__(self, source: str):
        self.source, self.errors, self.count = source, list[InputError](), 0

    def build(self, node: Any, line: int, depth: int) -> Value:
        self.count += 1
        if depth > _DEEPEST:
            raise InputError("nested too deeply (does an alias hold itself?)", self.source, line)
        if self.count > _MOST:
            raise InputError(f"more than {_MOST} values, aliases included", self.source, line)
        if str(node.tag) not in _TAGS:
            self.errors.append(InputError(f"tag {quote(node.tag)} is not known here, expected none", self.source, line))
        if isinstance(node, MappingNode):
            return self._build_map(node, line, depth)
        if isinstance(node, SequenceNode):
            items = [self.build(item, item.start_mark.line + 1, depth + 1) for item in node.value]
            return YamlList(items, line)
        self._refuse_control_characters(node.value, line)
        return YamlText(node.value, line, slice(node.start_mark.index, node.end_mark.index))

    def _refuse_control_characters(self, text: str, line: int) -> None:
        control = CONTROL_CHARACTER.search(text.replace("\n", " "))
        if control is not None:
            message = f"a control character (U+{ord(control[0]):04X}) in a text, expected plain text"
            self.errors.append(InputError(message, self.source, line))

    def _build_map(self, node: MappingNode, line: int, depth: int) -> YamlMap:
        items: dict[YamlText, Any] = {}
        for key, value in node.value:
            at = key.start_mark.line + 1
            if not isinstance(key, ScalarNode):
                self.errors.append(InputError("a key is a list or a mapping, expected a word", self.source, at))
                continue
            self._refuse_control_characters(key.value, at)
            name = YamlText(key.value, at)
            if name in items:
                first = next(k.line for k in items if k == name)
                message = f"key {quote(name)} is written twice, first in line {first}"
                self.errors.append(InputError(message, self.source, at))
                continue
            items[name] = self.build(value, at, depth + 1)
        return YamlMap(items, line)
