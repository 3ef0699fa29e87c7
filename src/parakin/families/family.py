"""A family of machines: chosen geometric numbers are inputs of every tape, so a batch may have a machine a row."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np

from ..algebra import Scalar, derivative
from ..arguments import RowsLike, check_arguments, check_constructor, read_rows
from ..arrays import Array
from ..errors import PoseError, quote
from ..kernels.batch import NEVER, NewtonSteps, evaluate_tape, solve_by_newton
from ..kernels.tape import NewtonTapes, Tape, compile_tape
from ..kinematics.closure_roots import MOST_STEPS, list_step_caps
from ..kinematics.tall_matrices import invert_from_left
from ..machine import Machine
from ..model.equations import Equations
from ..model.geometric_parameters import SIZES, Parameter, suggest_parameter
from ..model.nominal_values import SizedTrace

_OTHER_MODE = 1e-4  # of the greatest leg: by which joints of another working mode differ
_DISAGREE = 0.02  # likewise of more drives than freedoms, whose joints sizes that are off make disagree
_KEPT = 1e-6  # of a leg's closure: one of head and table in least squares, to which these have to keep


class FamilyRates(NamedTuple):
    """The closures f and their derivatives at poses: A x' + C s' = B q' for the rates of pose, sizes and joints.

    closures : (N, m), zero where the legs close; of legs mm², of head and table 1
    a : (N, m, n) = ∂f/∂x
    b : (N, m, m) = -∂f/∂q
    c : (N, m, k) = ∂f/∂s
    scales : (m,) what one of each closure is in the least squares of more drives than freedoms
    """

    closures: Array
    a: Array
    b: Array
    c: Array
    scales: Array

    def compute_size_rates(self) -> Array:
        """Compute how the pose moves with each size while the joints stand, (N, n, k): -A⁻¹C."""
        return -self.solve(self.c)

    def compute_joint_rates(self) -> Array:
        """Compute how the pose moves with each joint, (N, n, m): A⁻¹B."""
        return self.solve(self.b)

    def solve(self, right: Array) -> Array:
        """Solve A x = right, of more drives than freedoms by the forward's least squares, (N, n, k).

        right : (N, m, k)
        """
        if self.a.shape[1] == self.a.shape[2]:
            return solve_each(self.a, right)
        return invert_from_left(self.a, np.broadcast_to(np.diag(self.scales), self.b.shape)) @ right


def list_scales(machine: Machine) -> list[float]:
    """List what one of each closure is in the least squares of more drives than freedoms."""
    least = _KEPT * min(machine.leg_sizes)
    return [*machine.leg_sizes, *[least] * (len(machine.joints) - machine.leg_count)]


def solve_each(matrices: Array, right: Array) -> Array:
    """Solve a linear system for each matrix; NaN where it is singular or not a number."""
    good = np.flatnonzero(np.isfinite(matrices).all((1, 2)))
    good = good[np.abs(np.linalg.det(matrices[good])) > 0.0]
    result: Array = np.full(right.shape, np.nan)
    result[good] = np.linalg.solve(matrices[good], right[good])
    return result


@dataclass(frozen=True, eq=False)
class FamilySolution:
    """Poses of a family's machines for joints.

    poses : (..., axes), NaN where not converged
    residual : (...,) the greatest distance by which a leg fails to close there, mm
    converged : (...,) True where the legs close in the working mode, on the start's side of the singularities
    """

    poses: Array
    residual: Array
    converged: Any

    def __repr__(self) -> str:
        return f"<parakin family solution: {np.count_nonzero(self.converged)} of {np.size(self.converged)} poses found>"


@check_arguments
def make_family(machine: Machine, free: Sequence[str]) -> Family:
    """Make the family of a machine in which some of its numbers are free.

    machine : whose other numbers they all keep
    free : names of :attr:`Machine.parameters`, patterns such as ``legs.*.foot.*``, or groups such as ``feet``

    Raises :class:`PoseError` for a name that no parameter has.
    """
    return Family(machine, select_parameters(machine, free))


def select_parameters(machine: Machine, patterns: Sequence[str], argument: str = "free") -> tuple[Parameter, ...]:
    """Select a machine's parameters by names, patterns, or names of groups, in the machine's order.

    Raises :class:`PoseError` with the name of the ``argument`` for one that is unknown.
    """
    known = machine.parameters
    chosen: set[str] = set()
    for pattern in patterns:
        names = {p.name for p in known if fnmatchcase(p.name, pattern) or p.group == pattern}
        if not names:
            others = suggest_parameter(pattern, known, with_groups=True)
            raise PoseError(f"{argument}: unknown {quote(pattern)}{others}")
        chosen |= names
    return tuple(p for p in known if p.name in chosen)


@check_constructor
class Family:
    """Machines that differ in some of their numbers; every call takes poses or joints, and sizes, of any batch.

    machine : whose numbers the others are
    parameters : the k numbers that are free
    names, nominal : their names, and their values in the machine, (k,) mm and rad
    added : a number that follows a free named size is what this makes it, and its own difference to its nominal value
        is added; otherwise a number that is free itself follows no size

    Its methods share these arguments:

    poses, joints, mode : as of :class:`Machine`
    sizes : rows (..., k) of ``names``, mm and rad, or a dict of some of them, the rest is ``nominal``

    Leading shapes broadcast. Nothing is traced or compiled for a machine of its own. Values of the wrong shape, kind or
    name raise :class:`PoseError`.
    """

    def __init__(self, machine: Machine, parameters: Sequence[Parameter], added: bool = False):
        self.machine, self.parameters = machine, tuple(parameters)
        self._sized = [parameter.name for parameter in self.parameters if parameter.group == SIZES]
        self._added = added and bool(self._sized)
        self.names = tuple(parameter.name for parameter in self.parameters)
        self.nominal: Array = np.array([parameter.value for parameter in self.parameters], np.float64)
        self._tapes: dict[tuple[object, ...], Tape] = {}

    def __repr__(self) -> str:
        return f"<parakin family of {self.machine.name}: {len(self.names)} free numbers>"

    # Input.

    def _rows(self, given: Sequence[tuple[RowsLike, tuple[str, ...], str]], sizes: RowsLike) -> tuple[Any, ...]:
        """Check rows of poses and joints, and sizes; returns the leading shape, the rows beside each other, N rows."""
        arrays = [self._read(values, names, what) for values, names, what in given]
        units = [parameter.unit for parameter in self.parameters]
        own = read_rows(sizes, self.names, units, lambda: self.nominal, "sizes") if self.names else np.empty(0)
        arrays.append(own)
        try:
            lead = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError:
            shapes = " and ".join(str(array.shape) for array in arrays)
            raise PoseError(f"sizes: shapes {shapes} do not fit") from None
        wide = (np.broadcast_to(array, (*lead, array.shape[-1])) for array in arrays)
        return lead, [array.reshape(int(np.prod(lead)), array.shape[-1]) for array in wide]

    def _read(self, values: RowsLike, names: tuple[str, ...], what: str) -> Array:
        rows, lead = self.machine.rows(values, names, what)
        return rows.reshape(*lead, len(names))

    # Tapes: the inputs are columns of what is given, then the sizes.

    def _keep(
        self, key: tuple[object, ...], width: int, outputs: Callable[[Equations, list[Scalar]], list[Scalar]]
    ) -> Tape:
        tape = self._tapes.get(key)
        if tape is None:
            trace = SizedTrace(width, self.nominal.tolist())
            equations = self.trace_equations(trace.sizes)
            made = outputs(equations, trace.inputs(width))
            tape = self._tapes[key] = compile_tape(trace, made, width + len(self.names))
        return tape

    def trace_equations(self, sizes: Sequence[Scalar]) -> Equations:
        """Trace the equations of the machine of given sizes, k scalars of any kind."""
        own = dict(zip(self.names, sizes, strict=True))
        if not self._added:
            return self.machine.trace_equations(own)
        shifts = {p.name: own[p.name] - p.value for p in self.parameters}
        return self.machine.trace_equations({}, shifts)

    @property
    def _counts(self) -> tuple[int, int]:
        return len(self.machine.axes), len(self.machine.joints)

    # Answers.

    def evaluate(
        self,
        name: str,
        outputs: Callable[[list[Scalar], dict[str, Scalar]], list[Scalar]],
        poses: RowsLike,
        sizes: RowsLike,
    ) -> Array:
        """Evaluate functions of pose and sizes, (..., axes) and (..., k) -> (..., outputs).

        name : by which their tape is kept
        outputs : traces them from a pose and the sizes by their names
        """
        n = len(self.machine.axes)
        lead, rows = self._rows([(poses, self.machine.axes, "poses")], sizes)
        tape = self._keep((name,), n, lambda e, x: outputs(x, dict(zip(self.names, x[0].trace.sizes, strict=True))))
        return self._evaluate(tape, rows, tape.outputs).reshape(*lead, tape.outputs)

    def at(self, sizes: RowsLike) -> Machine:
        """Make the machine of given sizes (k,).

        Raises :class:`DescriptionError` where they are no machine that works.
        """
        lead, (rows,) = self._rows([], sizes)
        if lead != ():
            raise PoseError(f"sizes: one machine's expected, not {lead}")
        own = dict(zip(self.names, rows[0].tolist(), strict=True))
        if not self._added:
            return self.machine.replace_parameters(own)
        sized = self.machine.replace_parameters({name: own[name] for name in self._sized})
        differences = {p.name: own[p.name] - p.value for p in self.parameters if p.name not in self._sized}
        return sized.replace_parameters(
            {p.name: p.value + differences[p.name] for p in sized.parameters if p.name in differences}
        )

    def inverse(self, poses: RowsLike, sizes: RowsLike, mode: str | None = None) -> Array:
        """Compute joints for poses, (..., axes) and (..., k) -> (..., joints); NaN where the legs can't close."""
        mode, (n, m) = self.machine.checked_mode(mode), self._counts
        lead, rows = self._rows([(poses, self.machine.axes, "poses")], sizes)
        tape = self._keep(("inverse", mode), n, lambda e, x: e.invert(x, mode)[0])
        return self._evaluate(tape, rows, m).reshape(*lead, m)

    def margins(self, poses: RowsLike, sizes: RowsLike, mode: str | None = None) -> Array:
        """Compute every limit's margin, (..., axes) and (..., k) -> (..., limits); as :meth:`Machine.margins`."""
        mode, (n, _) = self.machine.checked_mode(mode), self._counts
        lead, rows = self._rows([(poses, self.machine.axes, "poses")], sizes)
        tape = self._keep(("margins", mode), n, lambda e, x: [g for _, g in e.own_margins(x, mode)])
        margins = evaluate_tape(tape, rows[0], np.empty((len(rows[0]), tape.outputs)), rows[1], whole=False)
        return margins.reshape(*lead, tape.outputs)

    def make_check_tape(self, limits: Sequence[int] | None = None, mode: str | None = None) -> Tape:
        """Compile pose, sizes -> margins of some limits.

        limits : their indices in :attr:`Machine.limits`; all by default
        """
        mode, (n, _) = self.machine.checked_mode(mode), self._counts
        chosen = tuple(range(len(self.machine.limits)) if limits is None else limits)

        def outputs(e: Equations, x: list[Scalar]) -> list[Scalar]:
            margins = [margin for _, margin in e.own_margins(x, mode)]
            return [margins[number] for number in chosen]

        return self._keep(("check", mode, chosen), n, outputs)

    def base_joints(self, poses: RowsLike, sizes: RowsLike, mode: str | None = None) -> Array:
        """Compute the struts' joints at the base, (..., axes) and (..., k) -> (..., struts, 3) mm, machine's frame."""
        mode, (n, _) = self.machine.checked_mode(mode), self._counts
        lead, rows = self._rows([(poses, self.machine.axes, "poses")], sizes)
        tape = self._keep(("base joints", mode), n, lambda e, x: [c for foot in e.list_feet(x, mode) for c in foot])
        feet = evaluate_tape(tape, rows[0], np.empty((len(rows[0]), tape.outputs)), rows[1], whole=False)
        return feet.reshape(*lead, -1, 3)

    def jacobians(self, poses: RowsLike, sizes: RowsLike, mode: str | None = None) -> tuple[Array, Array, Array]:
        """Compute A (..., m, n), B (..., m, m) and C (..., m, k) with A x' + C s' = B q' at poses with their joints.

        A and B are those of :meth:`Machine.jacobians`, C has the closures' derivatives by the sizes.
        """
        lead, rows = self._rows([(poses, self.machine.axes, "poses")], sizes)
        rates = self._differentiate("pose", rows[0], self.inverse(rows[0], rows[1], mode), rows[1])
        return tuple(array.reshape(*lead, *array.shape[1:]) for array in rates[1:4])  # type: ignore[return-value]

    def twist_rates(self, poses: RowsLike, joints: RowsLike, sizes: RowsLike) -> FamilyRates:
        """Compute closures, A, B and C for rows (N, ...) of poses, joints and sizes; x' is the tool's twist.

        The twist is the tip's velocity along the machine's translations and its small turns, which are regular where
        a pose's angles are not.
        """
        return self._differentiate("twist", poses, joints, sizes)

    def _differentiate(self, by: str, poses: RowsLike, joints: RowsLike, sizes: RowsLike) -> FamilyRates:
        (n, m), k = self._counts, len(self.names)
        machine = self.machine
        _, rows = self._rows([(poses, machine.axes, "poses"), (joints, machine.joints, "joints")], sizes)
        turns = len(machine.structure.turns) if by == "twist" else 0

        def outputs(e: Equations, x: list[Scalar]) -> list[Scalar]:
            pose, turn, given = x[:n], x[n : n + turns], x[n + turns :]
            rotation, origin, tilts = e.structure.closure(pose, e.list_serial(given), turn)
            f = [*e.closures(rotation, origin, given), *tilts]
            tip = [term for term, axis in zip(pose, e.axes, strict=True) if axis in "XYZ"]
            moved = [*tip, *turn] if by == "twist" else pose
            a, c = ([derivative(row, y) for row in f for y in terms] for terms in (moved, x[0].trace.sizes))
            return [*f, *a, *(-derivative(row, q) for row in f for q in given), *c]

        tape = self._keep((by,), n + turns + m, outputs)
        at_rest = np.zeros((len(rows[0]), turns))
        values = self._evaluate(tape, [rows[0], at_rest, *rows[1:]], m + m * n + m * m + m * k)
        f, a, b, c = np.split(values, np.cumsum([m, m * n, m * m]), axis=1)
        scales = np.array(list_scales(machine))
        return FamilyRates(f, a.reshape(-1, m, n), b.reshape(-1, m, m), c.reshape(-1, m, k), scales)

    def _evaluate(self, tape: Tape, rows: Sequence[Array], width: int) -> Array:
        first = np.hstack(rows[:-1]) if len(rows) > 2 else np.ascontiguousarray(rows[0])
        return evaluate_tape(tape, first, np.empty((len(first), width)), np.ascontiguousarray(rows[-1]))

    def forward(
        self, joints: RowsLike, sizes: RowsLike, near: RowsLike | None = None, mode: str | None = None
    ) -> FamilySolution:
        """Compute poses for joints by Newton's method, (..., joints) and (..., k) -> (..., axes), with a verdict each.

        near : poses (axes,) or (..., axes) to start from; by default home

        The answer lies on the side of the parallel singularities on which the start lies with the given joints and
        sizes, and in the working mode. With more drives than freedoms it is that of least squares, whether or not the
        joints agree with these sizes.
        """
        machine, mode = self.machine, self.machine.checked_mode(mode)
        starts = machine.home if near is None else near
        given = [(starts, machine.axes, "near"), (joints, machine.joints, "joints")]
        lead, (near_rows, joint_rows, size_rows) = self._rows(given, sizes)
        closed, leg_sizes = machine.closure_tolerance, machine.leg_sizes
        coordinates = machine.structure.coordinates
        caps = np.array(list_step_caps(coordinates, max(leg_sizes)))
        steps = NewtonSteps(caps, min(leg_sizes), MOST_STEPS, closed, NEVER)
        inputs = np.ascontiguousarray(np.hstack([joint_rows, size_rows]))
        roots = solve_by_newton(self._newton_tapes, steps, np.ascontiguousarray(near_rows), inputs, np.empty(0))
        with np.errstate(invalid="ignore"):
            converged = roots.steps < MOST_STEPS if machine.is_redundant else roots.residual <= closed
            converged &= np.isfinite(roots.residual) & (roots.turned > 0.0)
            own = self.inverse(roots.rows, size_rows, mode) - joint_rows
            own[:, machine.turning_joints] = np.remainder(own[:, machine.turning_joints] + np.pi, 2.0 * np.pi) - np.pi
            off = np.abs(own[:, : machine.leg_count])
            units = np.array(machine.joint_units[: machine.leg_count])
            apart = _DISAGREE if machine.is_redundant else _OTHER_MODE
            tolerance = np.where(units == "rad", apart, apart * max(leg_sizes))
            converged &= (off <= tolerance).all(1)
        roots.rows[~converged] = np.nan
        n = len(machine.axes)
        return FamilySolution(
            roots.rows.reshape(*lead, n), roots.residual.reshape(lead)[()], converged.reshape(lead)[()]
        )

    @property
    def _newton_tapes(self) -> NewtonTapes:
        n, m = self._counts
        w = len(self.machine.structure.coordinates)

        def begin(e: Equations, x: list[Scalar]) -> list[Scalar]:
            return e.structure.place_with_joints(x[:n], e.list_serial(x[n:])).coordinates

        def close(e: Equations, x: list[Scalar]) -> list[Scalar]:
            return e.scaled_closures(x[:w], x[w:])

        def close_with_slopes(e: Equations, x: list[Scalar]) -> list[Scalar]:
            f = close(e, x)
            return [*f, *(derivative(row, y) for row in f for y in x[:w])]

        return NewtonTapes(
            self._keep(("begin",), n + m, begin),
            self._keep(("closures",), w + m, close),
            self._keep(("slopes",), w + m, close_with_slopes),
            self._keep(("end",), w + m, lambda e, x: e.compute_pose(x[:w], x[w:])),
        )
