"""Lanes as vectors under compilation: arithmetic on them writes LLVM's intermediate code, a line an operation.

No line may be contracted or reordered, so the compiled code gives the same bits as NumPy does.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import partialmethod
from typing import NamedTuple

from .elementary import Lane, define_turns

NUMBER, INTEGER, TRUTH = "double", "i64", "i1"


class Code:
    """Lines of a function, in the order in which they are written."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.block = "entry"
        self._count = 0

    def name(self, prefix: str = "v") -> str:
        """Make a name that occurs once."""
        self._count += 1
        return f"{prefix}{self._count}"

    def add(self, operation: str) -> str:
        """Write a line that computes a value; returns the value's name."""
        name = f"%{self.name()}"
        self.lines.append(f"  {name} = {operation}")
        return name

    def do(self, operation: str) -> None:
        """Write a line that computes nothing."""
        self.lines.append(f"  {operation}")

    def begin_block(self, label: str) -> None:
        self.lines.append(f"{label}:")
        self.block = label


class LaneVector:
    """The name of a vector in the code, on which operators write lines."""

    __slots__ = ("kind", "lanes", "name")

    def __init__(self, lanes: VectorLanes, name: str, kind: str = NUMBER):
        self.lanes, self.name, self.kind = lanes, name, kind

    def apply(self, numbers: str, integers: str, other: Lane, reverse: bool = False) -> LaneVector:
        """Write an operation, named by the kind of its operands."""
        operands = [self, self.lanes.lift(other, self.kind)]
        one, two = reversed(operands) if reverse else operands
        operation = numbers if self.kind == NUMBER else integers
        kind = TRUTH if "cmp" in operation else self.kind
        return LaneVector(self.lanes, self.lanes.write(f"{operation} {{}} {one.name}, {two.name}", self.kind), kind)

    def __neg__(self) -> LaneVector:
        return LaneVector(self.lanes, self.lanes.write(f"fneg {{}} {self.name}"))

    def __abs__(self) -> LaneVector:
        return self.lanes.call("fabs", self)

    def __invert__(self) -> LaneVector:
        return self.apply("", "xor", -1 if self.kind == INTEGER else 1)


# Operators, and the instructions that they write for numbers and for integers.
_OPERATORS = {
    "add": ("fadd", "add"), "sub": ("fsub", "sub"), "mul": ("fmul", "mul"), "truediv": ("fdiv", "sdiv"),
    "and": ("", "and"), "or": ("", "or"), "xor": ("", "xor"), "lshift": ("", "shl"),
    "lt": ("fcmp olt", "icmp slt"), "le": ("fcmp ole", "icmp sle"), "gt": ("fcmp ogt", "icmp sgt"),
    "ge": ("fcmp oge", "icmp sge"), "eq": ("fcmp oeq", "icmp eq"), "ne": ("fcmp une", "icmp ne"),
}  # fmt: skip
for _name, (_numbers, _integers) in _OPERATORS.items():
    setattr(LaneVector, f"__{_name}__", partialmethod(LaneVector.apply, _numbers, _integers))
    if _numbers and "cmp" not in _numbers:
        setattr(LaneVector, f"__r{_name}__", partialmethod(LaneVector.apply, _numbers, _integers, reverse=True))


class Table(NamedTuple):
    """Rows in memory: the address, how many numbers a row has, and how many rows there are."""

    pointer: str
    width: int
    rows: str


class VectorLanes:
    """Arithmetic on vectors of ``count`` lanes; functions as of :class:`~.array_lanes.ArrayLanes`."""

    def __init__(self, code: Code, count: int):
        self.code, self.count = code, count
        self.sincos, self.atan2 = define_turns(self.select, self.read_bits, self.make_number)

    def type_of(self, kind: str) -> str:
        return f"<{self.count} x {kind}>"

    def write(self, operation: str, kind: str = NUMBER) -> str:
        """Write an operation, with the vector's type for {}."""
        return self.code.add(operation.format(self.type_of(kind)))

    def constant(self, value: float) -> LaneVector:
        (bits,) = struct.unpack("<Q", struct.pack("<d", float(value)))
        return LaneVector(self, f"splat (double 0x{bits:016X})")

    def lift(self, value: Lane, kind: str) -> LaneVector:
        """Return a vector, or a number as one of a kind."""
        if isinstance(value, LaneVector):
            return value
        return self.constant(value) if kind == NUMBER else LaneVector(self, f"splat ({kind} {int(value)})", kind)

    def call(self, function: str, *operands: LaneVector) -> LaneVector:
        """Call one of LLVM's own functions of vectors."""
        kind = self.type_of(NUMBER)
        given = ", ".join(f"{kind} {operand.name}" for operand in operands)
        return LaneVector(self, self.write(f"call {{}} @llvm.{function}.v{self.count}f64({given})"))

    def sqrt(self, x: LaneVector) -> LaneVector:
        return self.call("sqrt", x)

    def select(self, condition: LaneVector, x: Lane, y: Lane) -> LaneVector:
        kind = next((v.kind for v in (x, y) if isinstance(v, LaneVector)), NUMBER)
        one, two = (f"{self.type_of(kind)} {self.lift(v, kind).name}" for v in (x, y))
        return LaneVector(self, self.code.add(f"select {self.type_of(TRUTH)} {condition.name}, {one}, {two}"), kind)

    def read_bits(self, x: LaneVector) -> LaneVector:
        return LaneVector(self, self.write(f"bitcast {{}} {x.name} to {self.type_of(INTEGER)}"), INTEGER)

    def make_number(self, bits: LaneVector) -> LaneVector:
        return LaneVector(self, self.write(f"bitcast {{}} {bits.name} to {self.type_of(NUMBER)}", INTEGER))

    def _any(self, wanted: LaneVector) -> str:
        """Write whether a condition holds in any lane."""
        word = self.code.add(f"bitcast {self.type_of(TRUTH)} {wanted.name} to i{self.count}")
        return self.code.add(f"icmp ne i{self.count} {word}, 0")

    def branch(
        self, wanted: LaneVector, make: Callable[[], list[Lane]], otherwise: Callable[[], list[Lane]]
    ) -> list[LaneVector]:
        labels = [self.code.name("block") for _ in range(3)]
        self.code.do(f"br i1 {self._any(wanted)}, label %{labels[0]}, label %{labels[1]}")
        sources = []
        for label, function in zip(labels, (make, otherwise), strict=False):
            self.code.begin_block(label)
            vectors = [self.lift(value, NUMBER) for value in function()]
            sources.append((vectors, self.code.block))
            self.code.do(f"br label %{labels[2]}")
        self.code.begin_block(labels[2])
        (ones, one_label), (others, other_label) = sources
        return [
            LaneVector(
                self,
                self.write(f"phi {{}} [ {one.name}, %{one_label} ], [ {other.name}, %{other_label} ]", one.kind),
                one.kind,
            )
            for one, other in zip(ones, others, strict=True)
        ]

    def repeat(
        self, state: Sequence[Lane], step: Callable[[list[Lane]], tuple[list[Lane], LaneVector]]
    ) -> list[LaneVector]:
        def step_on(current: list[Lane], _: str) -> tuple[list[Lane], str]:
            after, going = step(current)
            return after, self._any(going)

        return self._loop(state, step_on)

    def walk(
        self,
        table: Table,
        state: Sequence[Lane],
        step: Callable[[list[Lane], Sequence[Lane]], tuple[list[Lane], LaneVector]],
    ) -> list[LaneVector]:
        def step_on(current: list[Lane], number: str) -> tuple[list[Lane], str]:
            pointer = self.code.add(f"getelementptr [{table.width} x {NUMBER}], ptr {table.pointer}, i64 {number}")
            after, going = step(current, self.load_shared(pointer, table.width))
            last = self.code.add(f"sub i64 {table.rows}, 1")
            more = self.code.add(f"icmp slt i64 {number}, {last}")
            return after, self.code.add(f"and i1 {self._any(going)}, {more}")

        return self._loop(state, step_on)

    def _loop(
        self, state: Sequence[Lane], step: Callable[[list[Lane], str], tuple[list[Lane], str]]
    ) -> list[LaneVector]:
        """Write a loop of after, goes_on = step(state, number of the turn)."""
        code, label, after = self.code, self.code.name("block"), self.code.name("block")
        first = [self.lift(value, NUMBER) for value in state]
        before, entered = code.block, len(code.lines)
        code.do(f"br label %{label}")
        code.begin_block(label)
        current = [LaneVector(self, f"%{code.name()}", vector.kind) for vector in first]
        number = f"%{code.name()}"
        last, goes_on = step(list(current), number)
        ended = [self.lift(value, like.kind) for value, like in zip(last, first, strict=True)]
        vectors = zip(current, first, ended, strict=True)
        phis = [(v.name, self.type_of(v.kind), one.name, two.name) for v, one, two in vectors]
        phis.append((number, INTEGER, "0", code.add(f"add i64 {number}, 1")))
        code.lines[entered + 2 : entered + 2] = [
            f"  {name} = phi {kind} [ {one}, %{before} ], [ {two}, %{code.block} ]" for name, kind, one, two in phis
        ]
        code.do(f"br i1 {goes_on}, label %{label}, label %{after}")
        code.begin_block(after)
        return ended

    def load_shared(self, pointer: str, width: int) -> list[LaneVector]:
        """Write the loading of one row that counts for all lanes."""
        kind, vectors = self.type_of(NUMBER), []
        for column in range(width):
            place = self.code.add(f"getelementptr {NUMBER}, ptr {pointer}, i64 {column}")
            number = self.code.add(f"load {NUMBER}, ptr {place}, align 8")
            one = self.code.add(f"insertelement {kind} poison, {NUMBER} {number}, i32 0")
            mask = f"<{self.count} x i32> zeroinitializer"
            vectors.append(LaneVector(self, self.code.add(f"shufflevector {kind} {one}, {kind} poison, {mask}")))
        return vectors
