"""Traces in which sizes of a machine are inputs, and what its numbers are where these have their nominal values."""

from __future__ import annotations

from collections.abc import Sequence

from ..algebra import Scalar, Term, Trace, evaluate_trace


class SizedTrace(Trace):
    """A trace whose inputs from number ``first`` on are sizes with nominal values."""

    def __init__(self, first: int, nominal: Sequence[float]):
        super().__init__()
        self.first, self.nominal = first, nominal

    @property
    def sizes(self) -> list[Term]:
        """The sizes as inputs."""
        return self.inputs(len(self.nominal), self.first)


def find_nominal_value(x: Scalar) -> float:
    """Find the value of a scalar that depends on sizes only, where these are nominal; a number is what it is."""
    if not isinstance(x, Term):
        return float(x)
    assert isinstance(x.trace, SizedTrace)
    return float(evaluate_trace(x.trace, [x], [float("nan")] * x.trace.first + list(x.trace.nominal))[0])
