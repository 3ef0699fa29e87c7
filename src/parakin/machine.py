"""The machine: what a user asks for kinematics both ways, Jacobians and limits. Input is checked here, once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from .algebra import Scalar, Vec
from .arguments import RowsLike, bound_angles, check_kind, check_range, read_rows, warn_of_wide_angles
from .arrays import Array, AxisRange
from .displays import Displayed
from .errors import NoMethodError, PoseError, quote
from .kernels.batch import evaluate_tape, evaluate_tape_with_residual
from .kinematics.assemblies import Assemblies, find_assemblies
from .kinematics.assembly_side import find_sides
from .kinematics.follow import follow_path, make_continuous
from .kinematics.forward import solve_forward
from .kinematics.inverse import solve_inverse
from .kinematics.limit_margins import compute_margins, find_broken_limits
from .kinematics.path_modes import PathMode, find_path_modes
from .kinematics.solution import Solution
from .kinematics.tapes import KinematicTapes, collect_tapes
from .kinematics.travel import LineTapes, Travel, compile_line_tapes, find_travel
from .kinematics.wrist.pole_thresholds import EXACT
from .machine_properties import MachineProperties
from .model.geometric_parameters import suggest_parameter
from .model.limits import compute_platform_points
from .model.structures import PlatformPlacement

_SHORTEST_DIRECTION = 1e-6  # mm or rad; travel in multiples of a shorter one overflows


class Machine(MachineProperties, Displayed):
    """A parallel kinematic machine. Made by :func:`parakin.load`; nothing of it changes after that.

    spec : its description, as its file gives it

    Its methods share these arguments:

    poses, pose : rows (..., axes), or one (axes,), of :attr:`axes`, mm and rad, of the tool in the workpiece's frame:
        its tip and the orientation R = Rz(C)·Ry(B)·Rx(A), or where :attr:`has_direction` its axis Rz(C)·Ry(B)·(0, 0, 1)
    joints : rows (..., joints) of :attr:`joints`, mm and rad
    mode : working mode, one of :attr:`modes`; by default :attr:`mode`

    Any leading shape goes, ``()`` included, and is kept, but where rows (N, axes) are asked for. A pose that is not a
    number or out of reach gives a row of NaN and leaves its neighbours alone. Values of the wrong shape, kind or name
    raise :class:`PoseError`.
    """

    def replace_parameters(
        self,
        values: Mapping[str, float],
        ranges: Mapping[str, AxisRange] | None = None,
        home: Mapping[str, float] | None = None,
    ) -> Machine:
        """Make the machine with other numbers, mm and rad, by the names of :attr:`parameters`.

        The numbers that are not among them follow its named sizes.

        values : the other numbers, by their names
        ranges : other ranges (low, high) of the legs' drives, mm and rad, by their names
        home : another home, mm and rad, by axes

        Raises :class:`PoseError` for an unknown name, :class:`DescriptionError` where they are no machine that works.
        """
        known = [parameter.name for parameter in self.parameters]
        for name in values:
            if name not in known:
                raise PoseError(f"parameters: unknown {quote(name)}{suggest_parameter(name, self.parameters)}")
        make_spec = partial(self._make_other_spec, values, ranges or {}, home or {})
        return Machine(make_spec({}), make_spec)

    # Input at the boundary.

    def rows(self, values: RowsLike, names: tuple[str, ...], what: str) -> tuple[Array, tuple[int, ...]]:
        """Check ``values`` and return them as C-ordered float64 rows (N, names), with their leading shape.

        values : numbers, or texts with their unit, ``"30 deg"``; a dict has values by name, the rest is home's
        names : :attr:`axes` or :attr:`joints`, of which they are
        what : the argument's name, for :class:`PoseError`
        """
        of_pose = names == self.axes
        units = self.axis_units if of_pose else self.joint_units

        def make_rest() -> Array:
            return self.home if of_pose else self.inverse(self.home)

        array = read_rows(values, names, units, make_rest, what)
        rows = np.ascontiguousarray(array.reshape(-1, len(names)))
        warn_of_wide_angles(values, rows, names, self._greatest_angles[0 if of_pose else 1], what)
        return rows, array.shape[:-1]

    @cached_property
    def _greatest_angles(self) -> tuple[Array, Array]:
        """Bounds (axes,) of a pose and (joints,) of joints, beyond which a number may be meant in degrees."""
        reach = [max(abs(drive.low), abs(drive.high)) for drive in self.drives]
        return bound_angles(self.axis_units, [0.0] * len(self.axes)), bound_angles(self.joint_units, reach)

    def _out(self, out: Array | None, shape: tuple[int, ...]) -> Array:
        if out is None:
            return np.empty(shape)
        if not isinstance(out, np.ndarray) or out.dtype != np.float64 or out.shape != shape or not out.flags.writeable:
            raise PoseError(f"out: a writeable float64 array of shape {shape} expected")
        return out

    # Kinematics.

    def inverse(self, poses: RowsLike, mode: str | None = None, out: Array | None = None) -> Array:
        """Compute joints for poses, (..., axes) -> (..., joints); a row of NaN where the legs can't close.

        Parameters
        ----------
        out : float64 array (..., joints) to fill, as in NumPy

        An angle that is free (a turning axis along the tool's) is 0; :meth:`follow` keeps the neighbour's instead.
        Limits are not looked at: see :meth:`check`. In the papers this is (2) and (7) of Zivanovic (HBG80, about 2000)
        for rods on slides, (26) to (28) and (39) to (41) of FME Transactions 41 (2013) for the Tricept, (6) to (11) of
        IJEEC 6 (2022) for Lambda legs.
        """
        rows, lead = self.rows(poses, self.axes, "poses")
        shape = (*lead, len(self.joints))
        result = self._out(out, shape)
        mode = self.checked_mode(mode)
        if result.flags.c_contiguous and not np.may_share_memory(result, rows):
            solve_inverse(self.model, rows, mode, result.reshape(-1, len(self.joints)))
        else:
            result[...] = solve_inverse(self.model, rows, mode).reshape(shape)
        return result

    def follow(self, poses: RowsLike, mode: str | None = None, free_below: float = EXACT) -> Array:
        """Compute joints along a path, (N, axes) -> (N, joints), continuous: angles unwound, free ones as before.

        A turning joint that is free (the tool's axis within ``free_below`` rad of it) takes its value from the last
        pose where it was not, at the path's start from the first one to come; turns are counted on over ±180°. Where
        the path passes over such a pole, head and table go on in their other working mode if that spares a swing, keeps
        the second of their joints in its range and every leg within reach.
        """
        rows, lead = self.rows(poses, self.axes, "poses")
        if len(lead) != 1:
            raise PoseError(f"poses: a path of shape (N, {len(self.axes)}) expected")
        check_range("free_below", free_below, 0.0, 0.5 * np.pi, "rad")
        return follow_path(self.model, rows, self.checked_mode(mode), float(free_below))

    def find_path_modes(self, poses: RowsLike) -> list[PathMode]:
        """Find which working modes carry a path of poses (N, axes) whole, and whether it stays in its assembly mode.

        One :class:`~.kinematics.path_modes.PathMode` for each of :attr:`modes`. What lies between the poses is not
        looked at: :func:`parakin.prepare` does that in one mode.
        """
        rows, lead = self.rows(poses, self.axes, "poses")
        if len(lead) != 1 or not len(rows):
            raise PoseError(f"poses: a path of shape (N, {len(self.axes)}) expected")
        return find_path_modes(self.model, rows, self.modes)

    def make_continuous(self, poses: Array, joints: Array, mode: str, free_below: float = EXACT) -> None:
        """Make joints (n, joints) of poses (n, axes) along a path continuous, in place; as :meth:`follow`.

        free_below : rad, as there
        """
        make_continuous(self.model, poses, joints, mode, free_below)

    def forward(
        self,
        joints: RowsLike,
        near: RowsLike | None = None,
        method: str | None = None,
        mode: str | None = None,
        agreement: float = 0.0,
    ) -> Solution:
        """Compute poses for joints, (..., joints) -> :class:`~.kinematics.solution.Solution`: residual and verdict too.

        Parameters
        ----------
        near : poses (axes,) or (..., axes) to start from and to stay near; without them the machine's home, and its
            assembly mode (in closed form: its working mode first)
        method : ``"closed"`` (three spheres, two circles), ``"newton"``, or ``"constant"`` (the Jacobian of the start
            kept throughout: FME Transactions 41, (31)); by default the closed form where there is one, else Newton
        mode : working mode that the legs stand in, head and table may stand in either of theirs; by default the
            machine's, but where a near pose tells by its own joints that the legs stand in another one, which
            ``in_other_mode`` of the solution says
        agreement : by how much legs may fail to close, mm, where joints of more drives than freedoms disagree

        Where there is no answer, ``why`` of the solution says the reason. The closed form of two circles is (3) to (5)
        of Zivanovic. Raises :class:`NoMethodError` for a closed form that the machine does not have.
        """
        rows, lead = self.rows(joints, self.joints, "joints")
        check_kind("method", method, str | None)
        check_range("agreement", agreement, 0.0, np.inf, "mm")
        starts = None if near is None else self._starts(near, lead)
        own = None if mode is None else self.checked_mode(mode)
        solution = solve_forward(self.model, rows, starts, method, own, float(agreement))
        return Solution(
            solution.poses.reshape(*lead, len(self.axes)),
            solution.residual.reshape(lead)[()],
            solution.converged.reshape(lead)[()],
            solution.steps.reshape(lead)[()],
            solution.why.reshape(lead)[()],
            solution.in_other_mode.reshape(lead)[()],
        )

    def _starts(self, near: RowsLike, lead: tuple[int, ...]) -> Array:
        """Return poses to start from as rows, as many as there are joint vectors."""
        rows, own_lead = self.rows(near, self.axes, "near")
        if own_lead == lead:
            return rows
        try:
            wide = np.broadcast_to(rows.reshape(*own_lead, len(self.axes)), (*lead, len(self.axes)))
        except ValueError:
            raise PoseError(
                f"near: shape {(*lead, len(self.axes))} expected, not {(*own_lead, len(self.axes))}"
            ) from None
        return np.ascontiguousarray(wide.reshape(-1, len(self.axes)))

    def assemblies(self, joints: RowsLike) -> Assemblies:
        """Find every real pose of one joint vector (joints,); see :class:`parakin.Assemblies`.

        Raises :class:`NoMethodError` where the legs leave a continuum of poses.
        """
        rows, lead = self.rows(joints, self.joints, "joints")
        if lead != ():
            raise PoseError(f"joints: one vector ({len(self.joints)},) expected, not {(*lead, len(self.joints))}")
        return self.list_assemblies(rows)[0]

    def list_assemblies(self, joints: RowsLike) -> list[Assemblies]:
        """Find every real pose of each row of joints (N, joints), on all cores; see :meth:`assemblies`."""
        rows, lead = self.rows(joints, self.joints, "joints")
        if len(lead) != 1:
            raise PoseError(f"joints: rows of shape (N, {len(self.joints)}) expected, not {(*lead, len(self.joints))}")
        return find_assemblies(self.model, rows) if len(rows) else []

    def travel(self, pose: RowsLike, axis: str | RowsLike, mode: str | None = None) -> Travel:
        """Prove the travel left from a pose (axes,) along an axis or a direction, both ways, and what ends it.

        Parameters
        ----------
        axis : name of an axis, or a direction (axes,) in mm and rad, or by names, of which travel is a multiple

        Every pose on the way keeps every limit, with the joints that a path takes along it, turns counted, and no
        parallel singularity is met; see :class:`~.kinematics.travel.Travel`.
        """
        start, mode = self._read_one(pose, self.axes, "pose"), self.checked_mode(mode)
        if not np.isfinite(start).all():
            raise PoseError("pose: numbers expected")
        return find_travel(self.model, start, self._read_direction(axis), mode)

    def _read_direction(self, axis: str | RowsLike) -> Array:
        """Read a direction (axes,): the name of an axis, values by names, or all values."""
        if isinstance(axis, str):
            if axis not in self.axes:
                raise PoseError(f"axis {axis!r}: one of {' '.join(self.axes)} expected")
            axis = {axis: 1.0}
        nothing = dict.fromkeys(self.axes, 0.0)
        direction = self._read_one({**nothing, **axis} if isinstance(axis, Mapping) else axis, self.axes, "axis")
        if not (np.isfinite(direction).all() and direction.any()):
            raise PoseError("axis: a direction that is not zero expected")
        if np.abs(direction).max() < _SHORTEST_DIRECTION:
            raise PoseError(f"axis: a direction of at least {_SHORTEST_DIRECTION:g} mm or rad expected")
        return direction

    def sides(self, poses: RowsLike) -> Array:
        """Compute the determinant whose sign tells the assembly mode, at rows of poses (n, axes): (n,)."""
        return find_sides(self.model, self.rows(poses, self.axes, "poses")[0], self.mode)

    def common_points(self, joints: RowsLike, side: float) -> tuple[Array, Array]:
        """Compute poses (n, axes) where the legs' spheres meet, for rows of joints (n, joints).

        Also what the legs fail to close there, (n,) mm.

        side : of the spheres' centres, as :attr:`home_side`; 1 or -1

        Raises :class:`NoMethodError` where :attr:`has_closed_forward` is false.
        """
        if not self.has_closed_forward:
            raise NoMethodError(f"{self.name}: no closed form of the direct problem")
        check_range("side", side, -1.0, 1.0)
        rows = self.rows(joints, self.joints, "joints")[0]
        poses = np.empty((len(rows), len(self.axes)))
        residual = evaluate_tape_with_residual(self.model.spheres_tape(side), rows, poses, np.empty((len(rows), 0)))
        return poses, residual

    def tapes(self, mode: str) -> KinematicTapes:
        """Compile the kinematics in a working mode for other interpreters, such as the C of a controller."""
        return collect_tapes(self.model, self.checked_mode(mode))

    def line_tapes(self, mode: str) -> LineTapes:
        """Compile the margins along a line of poses for other interpreters of intervals.

        Raises :class:`NoMethodError` where there is a :attr:`wrist`.
        """
        if self.wrist is not None:
            raise NoMethodError(f"{self.name}: margins along a line are compiled for machines without a wrist only")
        return compile_line_tapes(self.model, self.checked_mode(mode))

    def jacobians(self, poses: RowsLike, mode: str | None = None) -> tuple[Array, Array]:
        """Compute A (..., m, n) and B (..., m, m), with A x' = B q' for the rates of pose and joints.

        Rows of legs are their closures' derivatives (a rod's vector, mm); the last two rows of a machine with driven
        head or table say that the tool's axis turns with the pose's. det A = 0 (of more drives: its rank falls) at a
        parallel singularity or where the pose's angles are, B = 0; det B = 0 at a serial one. NaN out of reach. For the
        Orthoglide (3) of Chablat and Wenger (Chemnitz, 2000) has both, and its first (5) and (6) say where det A = 0;
        (30) of FME Transactions 41 is B⁻¹A of the Tricept's legs, by its platform's own coordinates.
        """
        rows, lead = self.rows(poses, self.axes, "poses")
        n, m = len(self.axes), len(self.joints)
        joints = self.inverse(rows, mode)
        both = evaluate_tape(self.model.jacobian_tape(), rows, np.empty((len(rows), m * n + m * m)), joints)
        return both[:, : m * n].reshape(*lead, m, n), both[:, m * n :].reshape(*lead, m, m)

    def twist_rates(self, poses: RowsLike, joints: RowsLike, whole: bool = True) -> tuple[Array, Array, Array]:
        """Compute A (N, m, n) and B (N, m, m) with A t' = B q' for the twist t', and the wrench norms of legs, mm.

        Poses and joints are rows (N, ...); see :class:`parakin.model.rates.TwistRates`.

        whole : a row is NaN if a number of it is not finite
        """
        n, m, rows = len(self.axes), len(self.joints), self.rows(poses, self.axes, "poses")[0]
        check_kind("whole", whole, bool)
        tape = self.model.rates_tape()
        both = evaluate_tape(tape, rows, np.empty((len(rows), tape.outputs)), self._joints_of(joints, len(rows)), whole)
        ends = m * n, m * (n + m)
        return both[:, : ends[0]].reshape(-1, m, n), both[:, ends[0] : ends[1]].reshape(-1, m, m), both[:, ends[1] :]

    def constraint_rates(self, poses: RowsLike) -> Array:
        """Compute the constraints' rates (n, c, c) by the parasitic motions, at rows of poses; NaN out of reach.

        Columns are the parasitic translations, 1, then turns, mm; without constraints c is 0. See
        :meth:`~.model.structures.Structure.list_constraint_rates`.
        """
        rows = self.rows(poses, self.axes, "poses")[0]
        c = len(self.spec.constraints)
        rates = np.empty((len(rows), c * c))
        return (evaluate_tape(self.model.constraint_rates_tape(), rows, rates) if c else rates).reshape(len(rows), c, c)

    def place_platform(self, pose: RowsLike, mode: str, joints: RowsLike | None = None) -> PlatformPlacement:
        """Find the platform's frame for a pose (axes,), in a working mode or for the joints that a path takes there."""
        row, mode = self._read_one(pose, self.axes, "pose"), self.checked_mode(mode)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            if joints is None:
                return self.structure.place(list(row), self.model.split_mode(mode)[1])
            own = self._read_one(joints, self.joints, "joints")
            return self.structure.place_with_joints(list(row), list(own[self.leg_count :]))

    def _read_one(self, values: RowsLike, names: tuple[str, ...], what: str) -> Array:
        """Read one row (names,) of poses or joints."""
        rows, lead = self.rows(values, names, what)
        if lead:
            raise PoseError(f"{what}: one of {' '.join(names)} expected, not {len(rows)}")
        return np.asarray(rows[0])

    def place_leg_joints(self, placement: PlatformPlacement) -> list[Vec]:
        """Compute the platform's joint of every leg in the base frame, mm.

        placement : the platform's, of :meth:`place_platform`
        """
        return compute_platform_points(self.spec, placement.rotation, placement.origin)

    def locate_passive_rods(
        self, placement: PlatformPlacement, joints: Sequence[Sequence[Scalar]]
    ) -> dict[str, tuple[Vec, Vec]]:
        """Locate both ends of each of :attr:`passive_rods` in the base frame, mm, foot first.

        placement : the platform's, of :meth:`place_platform`
        joints : those of each leg, as :meth:`group_joints` has them
        """
        return self.model.locate_passive_rods(placement, joints)

    # Limits.

    def _joints_of(self, joints: RowsLike, count: int) -> Array:
        rows = self.rows(joints, self.joints, "joints")[0]
        if len(rows) != count:
            raise PoseError(f"joints: {count} rows expected, as many as poses, not {len(rows)}")
        return rows

    def margins(self, poses: RowsLike, joints: RowsLike | None = None, mode: str | None = None) -> Array:
        """Compute every limit's margin, (..., limits), ≥ 0 where it holds; units as in :attr:`limit_definitions`.

        ``joints`` may give those that a path really takes (turns counted, free angles held), else they are the
        inverse's. Margins that do not exist where a leg can't close are NaN.
        """
        rows, lead = self.rows(poses, self.axes, "poses")
        given = None if joints is None else self._joints_of(joints, len(rows))
        return compute_margins(self.model, rows, given, self.checked_mode(mode)).reshape(*lead, len(self.limits))

    def check(self, poses: RowsLike, joints: RowsLike | None = None, mode: str | None = None) -> Any:
        """Return 0 where a pose is allowed, else 1 + the index in :attr:`limits` of the first one broken, (...,) int.

        A pose that is not a number breaks the first limit. ``joints`` as in :meth:`margins`.
        """
        rows, lead = self.rows(poses, self.axes, "poses")
        given = None if joints is None else self._joints_of(joints, len(rows))
        return find_broken_limits(self.model, rows, given, self.checked_mode(mode)).reshape(lead)[()]
