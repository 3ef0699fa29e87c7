"""Compile a program of lanes to the processor's own vector code: a loop over rows, by LLVM.

Rows are C-ordered. A block of rows is turned to a vector a column by shuffles, and back. The last block of a batch
overlaps the one before it, so that every block is whole.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cache
from threading import Lock
from typing import Any

from .lane_program import Columns, Program
from .vector_lanes import NUMBER, TRUTH, Code, LaneVector, Table, VectorLanes

GROUP = 8  # rows that are transposed at once
SHORT = 256  # operations up to which two groups run side by side: one waits for results while the other computes
OPTIMISATION = 3  # of LLVM's code generation; its passes over the intermediate code gain nothing
_OF_ROWS = f"<{GROUP} x {NUMBER}>"
_LOCK = Lock()  # LLVM's context is shared

Gather = Sequence[tuple[int, int]]


def _choose_entries(code: Code, one: str, two: str, mask: Sequence[int]) -> str:
    places = ", ".join(f"i32 {place}" for place in mask)
    return code.add(f"shufflevector {_OF_ROWS} {one}, {_OF_ROWS} {two}, <{len(mask)} x i32> <{places}>")


def _gather_entries(code: Code, vectors: Sequence[str], entries: Gather) -> str:
    """Make one vector of entries, each a vector's number and a place in it, by shuffles of two vectors at a time."""
    first, *others = dict.fromkeys(number for number, _ in entries)
    result = _choose_entries(code, vectors[first], vectors[first], [place if n == first else 0 for n, place in entries])
    for other in others:
        mask = [GROUP + place if n == other else i for i, (n, place) in enumerate(entries)]
        result = _choose_entries(code, result, vectors[other], mask)
    return result


def _transpose_square(code: Code, vectors: Sequence[str]) -> list[str]:
    """Transpose GROUP vectors by exchanges of halves, quarters and single entries."""
    result = list(vectors)
    for bit in (4, 2, 1):
        for i in (i for i in range(GROUP) if not i & bit):
            one, two = result[i], result[i | bit]
            low = [GROUP + (p ^ bit) if p & bit else p for p in range(GROUP)]
            high = [GROUP + p if p & bit else p | bit for p in range(GROUP)]
            result[i], result[i | bit] = _choose_entries(code, one, two, low), _choose_entries(code, one, two, high)
    return result


def _list_places(width: int) -> list[list[int]]:
    """List where the vectors of GROUP rows begin, in squares of GROUP columns; rows that are shorter are one piece."""
    if width < GROUP:
        return [[GROUP * i for i in range(width)]]
    firsts = [*range(0, width - GROUP, GROUP), width - GROUP]
    return [[row * width + first for row in range(GROUP)] for first in firsts]


def _point(code: Code, pointer: str, offset: int | str, kind: str = NUMBER) -> str:
    return code.add(f"getelementptr {kind}, ptr {pointer}, i64 {offset}")


def _load_group(code: Code, pointer: str, width: int) -> list[str]:
    """Write the loading of GROUP rows, a vector a column."""
    columns = [""] * width
    for piece in _list_places(width):
        vectors = [code.add(f"load {_OF_ROWS}, ptr {_point(code, pointer, place)}, align 8") for place in piece]
        if width < GROUP:
            return [
                _gather_entries(code, vectors, [divmod(row * width + c, GROUP) for row in range(GROUP)])
                for c in range(width)
            ]
        columns[piece[0] : piece[0] + GROUP] = _transpose_square(code, vectors)
    return columns


def _store_group(code: Code, pointer: str, columns: Sequence[str]) -> None:
    """Write the storing of GROUP rows from a vector a column."""
    width = len(columns)
    for piece in _list_places(width):
        if width < GROUP:
            vectors = [
                _gather_entries(code, columns, [divmod(GROUP * i + k, width)[::-1] for k in range(GROUP)])
                for i in range(width)
            ]
        else:
            vectors = _transpose_square(code, columns[piece[0] : piece[0] + GROUP])
        for vector, place in zip(vectors, piece, strict=True):
            code.do(f"store {_OF_ROWS} {vector}, ptr {_point(code, pointer, place)}, align 8")


def _join_groups(lanes: VectorLanes, vectors: Sequence[str]) -> LaneVector:
    """Write one vector of all lanes from those of the groups."""
    if len(vectors) == 1:
        return LaneVector(lanes, vectors[0])
    return LaneVector(lanes, _choose_entries(lanes.code, vectors[0], vectors[1], range(2 * GROUP)))


def _split_groups(lanes: VectorLanes, vector: LaneVector) -> list[str]:
    """Write the vectors of the groups from one of all lanes."""
    if lanes.count == GROUP:
        return [vector.name]
    kind = lanes.type_of(NUMBER)
    masks = [", ".join(f"i32 {group + i}" for i in range(GROUP)) for group in range(0, lanes.count, GROUP)]
    return [
        lanes.code.add(f"shufflevector {kind} {vector.name}, {kind} poison, <{GROUP} x i32> <{mask}>") for mask in masks
    ]


def _load_rows(lanes: VectorLanes, array: str, width: int, row: str) -> list[LaneVector]:
    """Write the loading of a block of rows from ``row`` on."""
    start = _point(lanes.code, array, lanes.code.add(f"mul i64 {row}, {width}"))
    groups = [
        _load_group(lanes.code, _point(lanes.code, start, first * width), width)
        for first in range(0, lanes.count, GROUP)
    ]
    return [_join_groups(lanes, vectors) for vectors in zip(*groups, strict=True)]


_CASTS = {"float32": "fptrunc", "int32": "fptosi", "int64": "fptosi", "uint8": "fptoui", "uint16": "fptoui"}
_TYPES = {"bool": "i8", "uint8": "i8", "uint16": "i16", "int32": "i32", "int64": "i64"}


def _take_once(lanes: VectorLanes, array: str, columns: Columns) -> list[LaneVector] | Table:
    """Take what is the same for all rows: a row of numbers, loaded, or a table."""
    if columns.role == "table":
        return Table(array, columns.width, f"{array}.rows")
    return lanes.load_shared(array, columns.width)


def _store_rows(lanes: VectorLanes, array: str, made: Columns, row: str, vectors: Sequence[LaneVector]) -> None:
    """Write the storing of a block of rows from ``row`` on."""
    code, width = lanes.code, made.width
    if made.kind == "float64":
        start = _point(code, array, code.add(f"mul i64 {row}, {width}"))
        groups = zip(*[_split_groups(lanes, vector) for vector in vectors], strict=True)
        for number, columns in enumerate(groups):
            _store_group(code, _point(code, start, number * GROUP * width), columns)
        return
    (vector,), kind = vectors, _TYPES[made.kind]
    cast = "zext" if vector.kind == TRUTH else _CASTS[made.kind]
    value = lanes.write(f"{cast} {{}} {vector.name} to {lanes.type_of(kind)}", vector.kind)
    code.do(f"store {lanes.type_of(kind)} {value}, ptr {_point(code, array, row, kind)}, align 1")


def write_function(program: Program, count: int) -> str:
    """Write a program in LLVM's intermediate code: a function of arrays' addresses and the first and last row."""
    code = Code()
    lanes = VectorLanes(code, count)
    arrays = [f"%array{i}" for i in range(len(program.inputs) + len(program.outputs))]
    given = list(zip(arrays, program.inputs, strict=False))
    once = {array: _take_once(lanes, array, columns) for array, columns in given if columns.role != "rows"}
    code.do("br label %rows")
    code.begin_block("rows")
    code.do("%row = phi i64 [ %start, %entry ], [ %next, %again ]")
    inputs = [
        once[array] if array in once else _load_rows(lanes, array, columns.width, "%row") for array, columns in given
    ]
    results = program.body(lanes, inputs)
    for array, made, vectors in zip(arrays[len(inputs) :], program.outputs, results, strict=True):
        _store_rows(lanes, array, made, "%row", [lanes.lift(vector, NUMBER) for vector in vectors])
    kind = lanes.type_of(NUMBER)
    parameters = [f"ptr noalias {array}" for array in arrays]
    parameters += [f"i64 {columns.rows}" for columns in once.values() if isinstance(columns, Table)]
    return "\n".join(
        [
            *[f"declare {kind} @llvm.{name}.v{count}f64({kind})" for name in ("fabs", "sqrt")],
            f"define void @compute({', '.join([*parameters, 'i64 %start', 'i64 %stop'])}) #0 {{",
            "entry:",
            f"  %last = sub i64 %stop, {count}",
            *code.lines,
            "  br label %again",
            "again:",
            f"  %after = add i64 %row, {count}",
            "  %over = icmp sgt i64 %after, %last",
            "  %next = select i1 %over, i64 %last, i64 %after",
            "  %done = icmp sge i64 %after, %stop",
            "  br i1 %done, label %out, label %rows",
            "out:",
            "  ret void",
            "}",
            'attributes #0 = { nounwind "prefer-vector-width"="512" }',  # LLVM's default halves them on many x86
        ]
    )


def choose_lanes(program: Program) -> int:
    """Choose how many rows a block of a program has."""
    return 2 * GROUP if program.length <= SHORT else GROUP


@cache
def _start_llvm() -> Any:
    """Start LLVM for this processor; returns its target."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


def compile_program(program: Program) -> Callable[..., None]:
    """Compile a program; returns a function of the arrays' addresses and the first and last row.

    There must be as many rows as :func:`choose_lanes` says, or more. It releases the interpreter's lock.
    """
    import llvmlite.binding as llvm

    text = write_function(program, choose_lanes(program))
    with _LOCK:
        machine = _start_llvm().create_target_machine(
            cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=OPTIMISATION
        )
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
        engine.finalize_object()
        address = engine.get_function_address("compute")
    pointers = [ctypes.c_void_p] * (len(program.inputs) + len(program.outputs))
    counts = [ctypes.c_int64] * sum(columns.role == "table" for columns in program.inputs)
    function: Any = ctypes.CFUNCTYPE(None, *pointers, *counts, ctypes.c_int64, ctypes.c_int64)(address)
    function.engine = engine  # owns the code
    return function  # type: ignore[no-any-return]
