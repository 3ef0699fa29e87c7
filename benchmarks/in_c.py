"""A trace as straight-line C over libm: what an integrator writes by hand and compiles with gcc -O2."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from parakin import algebra as alg
from parakin.algebra import Scalar, Term, Trace

_CALLS = {
    alg.DIV: "{0} / {1}",
    alg.SQRT: "sqrt({0})",
    alg.SIN: "sin({0})",
    alg.COS: "cos({0})",
    alg.ATAN2: "atan2({0}, {1})",
    alg.MIN: "fmin({0}, {1})",
    alg.MAX: "fmax({0}, {1})",
    alg.ABS: "fabs({0})",
    alg.COPYSIGN: "copysign({0}, {1})",
}


def _expression(y: Term) -> str:
    names = [f"t{a.index}" for a in y.args]
    if y.op == alg.INPUT:
        return f"x[{int(y.k[0])}]"
    if y.op == alg.LIN:
        return " + ".join([repr(y.k[0]), *[f"{k!r} * {n}" for k, n in zip(y.k[1:], names, strict=True)]])
    if y.op == alg.QUAD:
        return " + ".join(f"{k!r} * {names[2 * i]} * {names[2 * i + 1]}" for i, k in enumerate(y.k))
    if y.op == alg.FMA:
        return f"{y.k[0]!r} * {names[0]} * {names[1]} + {y.k[1]!r} * {names[2]} + {y.k[2]!r}"
    return _CALLS[y.op].format(*names)


def source(trace: Trace, outputs: list[Scalar], inputs: int) -> str:
    """C of ``void batch(long n, const double *x, double *y)`` over C-ordered rows."""
    needed: set[int] = set()
    stack = [y for y in outputs if isinstance(y, Term)]
    while stack:
        term = stack.pop()
        if term.index not in needed:
            needed.add(term.index)
            stack.extend(term.args)
    body = [f"    const double t{i} = {_expression(trace.nodes[i])};" for i in sorted(needed)]
    body += [f"    y[{i}] = {f't{y.index}' if isinstance(y, Term) else repr(y)};" for i, y in enumerate(outputs)]
    head = ["#include <math.h>", "void batch(long n, const double *x, double *y)", "{"]
    loop = f"  for (long i = 0; i < n; i++, x += {inputs}, y += {len(outputs)}) {{"
    return "\n".join([*head, loop, *body, "  }", "}", ""])


def compiled(text: str, flags: tuple[str, ...] = ("-O2",)) -> Callable[[np.ndarray, np.ndarray], None]:
    """The batch function of C source, built by gcc."""
    folder = Path(tempfile.mkdtemp())
    (folder / "batch.c").write_text(text)
    subprocess.run(
        ["gcc", *flags, "-shared", "-fPIC", "-o", folder / "batch.so", folder / "batch.c", "-lm"], check=True
    )
    batch = ctypes.CDLL(str(folder / "batch.so")).batch
    batch.restype = None

    def call(x: np.ndarray, y: np.ndarray) -> None:
        batch(ctypes.c_long(len(x)), x.ctypes.data_as(ctypes.c_void_p), y.ctypes.data_as(ctypes.c_void_p))

    return call
