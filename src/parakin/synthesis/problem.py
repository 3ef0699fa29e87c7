"""Design problems: which numbers of a machine are free, what is wanted of it, and what is best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite

import numpy as np

from ..arguments import check_constructor
from ..arrays import Array, AxisRange
from ..errors import PoseError, quote, suggest
from ..families.family import Family
from ..machine import Machine
from ..model.geometric_parameters import suggest_parameter
from ..toolpath.path import ToolPath
from ..units import name_display_unit, to_display
from .design_tapes import DesignTapes
from .manufactured import Reserve, SizeBox
from .measures import Measures
from .part_timing import PartTimer
from .pose_sets import PoseSet, check_ends, make_box_set, make_cylinder_set
from .wants import WANTS
from .workspace_gauge import WorkspaceGauge


@check_constructor
@dataclass(frozen=True, eq=False)
class DesignProblem:
    """A problem of dimensional synthesis; lengths are mm, angles rad.

    Parameters
    ----------
    machine : whose other numbers and limits all designs share
    free : the ranges of the machine's free numbers, by names of :attr:`Machine.parameters`
    box : (low, high) of each axis X, Y, Z, of the tool's orientation a range or one value; axes left out are as at home
    minimise, maximise : one or more of the free numbers, and of the quantities that ``bounds`` can have, each its way
    shift : how far the poses may be moved: ranges by an axis, or by several that are moved together (``"X Y Z"``)
    bounds : the greatest ``amplification`` λ (1/λ ≤ psi ≤ λ all over the poses), ``greatest_amplification`` (psi ≤ λ
        alone) or ``condition`` number; the least ``stiffness`` of the tip over all directions, N/mm; the greatest
        ``accuracy``, the root mean square of the tip's error within the tolerances; the least ``clearance`` of the axes
        of struts that share no joint; the greatest ``stroke`` of a leg's drive; the greatest ``footprint``: the
        diameter, about the machine's Z axis, of the circle that holds the struts' joints at the base; the greatest
        ``cycle_time`` of the part, s; the ``workspace``, an objective alone: the volume of the positions at which every
        orientation of the box is allowed
    fit_strokes : the ranges of the legs' drives become what the poses need; otherwise they are the machine's own
    cylinder : more poses, or these alone: ``along`` an axis, ``diameter``, the other axes as in ``box``, of those
        across it the middle
    poses : more of them, each as a box that may have no width
    drives, struts : for stiffness, as of :func:`parakin.analyse_stiffness`
    tolerances : for accuracy, as of :func:`parakin.analyse_accuracy`
    path : of a part that every design must run; it is moved with the poses
    workpiece : where the part lies, as for :func:`parakin.prepare`
    within : manufacturing tolerances, as for accuracy: all machines within them must keep the limits and bounds, too;
        the part runs on the nominal one

    Its methods share these arguments:

    x : designs, rows of :attr:`variables`, mm and rad
    points : (P, :attr:`width`) poses: the number of a set, then coordinates in a box of edges 1

    Raises :class:`PoseError` for numbers, axes and quantities that are unknown, ranges that are empty, and objectives
    or bounds that lack what they need (springs, tolerances, a path).
    """

    machine: Machine
    free: Mapping[str, AxisRange]
    box: Mapping[str, AxisRange | float]
    minimise: Sequence[str] = ()
    shift: Mapping[str, AxisRange] = field(default_factory=dict)
    bounds: Mapping[str, float] = field(default_factory=dict)
    fit_strokes: bool = False
    maximise: Sequence[str] = ()
    cylinder: Mapping[str, AxisRange | float | str] | None = None
    poses: Sequence[Mapping[str, AxisRange | float]] = ()
    drives: Mapping[str, str] | str | None = None
    struts: Mapping[str, str] | str | None = None
    tolerances: Mapping[str, str] | None = None
    path: ToolPath | None = None
    workpiece: Array | None = None
    within: Mapping[str, str] | None = None

    def __repr__(self) -> str:
        return f"<parakin design problem of {self.machine.name}: {len(self.free)} free numbers>"

    def __post_init__(self) -> None:
        if not self.free:
            raise PoseError("free: at least one number expected")
        known = [parameter.name for parameter in self.machine.parameters]
        for name in self.free:
            if name not in known:
                raise PoseError(f"free: unknown {quote(name)}{suggest_parameter(name, self.machine.parameters)}")
        for what, ranges in (("free", self.free), ("shift", self.shift)):
            for name, (low, high) in ranges.items():
                check_ends(f"{what}: {name}", low, high, low < high)
        self._check_poses()
        self._check_wants()
        nominal = {parameter.name: parameter.value for parameter in self.family.parameters}
        self.make_size_box(self.machine.replace_parameters(nominal) if self.within else self.machine)

    def _check_poses(self) -> None:
        moved = [axis for key in self.shift for axis in key.split()]
        if len(set(moved)) < len(moved) or not set(moved) <= set("XYZ") & set(self.machine.axes):
            axes = " ".join(axis for axis in self.machine.axes if axis in "XYZ")
            raise PoseError(f"shift: some of {axes} expected, each once")
        if not self.pose_sets:
            raise PoseError("box: missing, as are cylinder and poses; one of them expected")
        if self.box and not any(e[0] < e[1] for axis, e in self.pose_sets[0].ends.items() if axis in "XYZ"):
            raise PoseError("box: a range of X, Y or Z expected")

    def _check_wants(self) -> None:
        for name, bound in self.bounds.items():
            if name not in WANTS:
                raise PoseError(f"bounds: unknown {quote(name)}{suggest(name, tuple(WANTS))}")
            if not WANTS[name].bounded:
                raise PoseError(f"bounds: {name} has none; it can be an objective")
            least = WANTS[name].least
            if not (isfinite(bound) and bound > least):
                raise PoseError(f"bounds: {name}: a number above {least:g} expected, not {bound:g}")
        known = [*WANTS, *self.free]
        for what, names in (("minimise", self.minimise), ("maximise", self.maximise)):
            for name in names:
                if name not in known:
                    raise PoseError(f"{what}: unknown {quote(name)}{suggest(name, known)}")
                if name in WANTS and WANTS[name].more != (what == "maximise"):
                    way, key = ("more", "maximise") if WANTS[name].more else ("less", "minimise")
                    raise PoseError(f"{what}: of {name} {way} is better; it belongs to {key}")
        if not self.objectives:
            raise PoseError("minimise: missing, as is maximise; one objective or more expected")
        if len(set(self.objectives)) < len(self.objectives):
            what = "maximise" if set(self.minimise) & set(self.maximise) else "minimise"
            raise PoseError(f"{what}: each objective once expected")
        psi, greatest = self.bounds.get("amplification"), self.bounds.get("greatest_amplification")
        if psi is not None and greatest is not None and greatest * psi < 1.0:
            low = f"{1.0 / psi:.6g}"
            raise PoseError(
                f"bounds: they contradict: amplification wants psi above {low}, greatest_amplification below"
            )
        if "stroke" in self.wants and not self.fit_strokes:
            raise PoseError("fit_strokes: the drives' ranges are the machine's own, stroke needs them fitted")
        if "workspace" in self.wants:
            if self.fit_strokes:
                raise PoseError("fit_strokes: the drives' ranges are fitted, workspace needs the machine's own")
            self.gauge  # noqa: B018  refuses a workspace without end
        if "clearance" in self.wants and not self.machine.trace_equations({}).list_strut_distances(
            self.machine.home.tolist(), self.machine.mode
        ):
            raise PoseError("bounds: clearance: every two struts share a joint")
        if self.timer is None and "cycle_time" in self.wants:
            raise PoseError("path: missing, cycle_time needs it")
        if self.timer is None and self.workpiece is not None:
            raise PoseError("workpiece: there is no path that it places")
        for name, needed in (("stiffness", "springs"), ("accuracy", "tolerances")):
            if name in self.wants:
                getattr(self.tapes, needed)

    @property
    def objectives(self) -> tuple[str, ...]:
        """What is minimised, then what is maximised."""
        return (*self.minimise, *self.maximise)

    @property
    def wants(self) -> tuple[str, ...]:
        """The quantities that are bounded or are objectives, in the table's order."""
        return tuple(name for name in WANTS if name in self.bounds or name in self.objectives)

    def get_sign(self, name: str) -> float:
        """Return the factor, 1 or -1, with which less of a quantity or a free number is better.

        name : the quantity's or the number's
        """
        return WANTS[name].sign if name in WANTS else -1.0 if name in self.maximise else 1.0

    @cached_property
    def pose_sets(self) -> tuple[PoseSet, ...]:
        """The wanted poses: the box, the cylinder, then the others."""
        sets = [make_box_set(self.machine, self.box, "box")] if self.box else []
        sets += [] if self.cylinder is None else [make_cylinder_set(self.machine, self.cylinder)]
        return (*sets, *(make_box_set(self.machine, axes, "poses") for axes in self.poses))

    @cached_property
    def tapes(self) -> DesignTapes:
        """The tapes of the machine with its free numbers."""
        return self.make_tapes(self.machine, list(self.free))

    def make_tapes(self, machine: Machine, free: Sequence[str]) -> DesignTapes:
        """Make the tapes of a ``machine`` with ``free`` numbers, and what else the problem says."""
        return DesignTapes(machine, free, self.fit_strokes, self.drives, self.struts, self.tolerances)

    def make_size_box(self, machine: Machine) -> SizeBox | None:
        """Make the box of numbers within tolerance of a design's ``machine``; None without tolerances."""
        if self.within is None:
            return None
        try:
            return SizeBox(machine, self.within)
        except PoseError as error:
            raise PoseError(f"within: {error}") from None

    @cached_property
    def reserve(self) -> Reserve:
        """What designs keep in hand for tolerances; it grows as they are known."""
        legs = self.machine.leg_count
        return Reserve(np.zeros(len(self.tapes.counted)), np.zeros(legs), np.zeros(legs))

    @cached_property
    def timer(self) -> PartTimer | None:
        """What times the part; None without one."""
        if self.path is None:
            return None
        return PartTimer(self.family, self.path, self.workpiece, self.list_shifts(self.ranges.mean(1)))

    @cached_property
    def gauge(self) -> WorkspaceGauge | None:
        """What gauges the workspace; None where it is not wanted."""
        return WorkspaceGauge(self.tapes, self.pose_sets[0]) if "workspace" in self.wants else None

    @property
    def family(self) -> Family:
        """The machine's family of its free numbers."""
        return self.tapes.family

    @cached_property
    def variables(self) -> tuple[str, ...]:
        """The free numbers, in the family's order, and the shifts."""
        return (*self.family.names, *(f"shift {key}" for key in self.shift))

    def format_variables(self, values: Mapping[str, float], digits: str) -> str:
        """Format ``values`` of the variables, mm and rad, in a line, each with its unit; ``digits`` is a format."""
        units = {parameter.name: parameter.unit for parameter in self.family.parameters}
        own = ((name, value, units.get(name, "mm")) for name, value in values.items())
        return ", ".join(f"{name} {to_display(value, u):{digits}} {name_display_unit(u)}" for name, value, u in own)

    @cached_property
    def ranges(self) -> Array:
        """Low and high of each variable, (variables, 2) mm and rad."""
        return np.array([*(self.free[name] for name in self.family.names), *self.shift.values()], float)

    # Poses go by points: the number of a set, then its coordinates in a box of edges 1; columns of no use are 0.

    @cached_property
    def width(self) -> int:
        """The columns of a point."""
        return 1 + max(len(poses.coordinates) for poses in self.pose_sets)

    def make_points(self, number: int, inside: Array) -> Array:
        """Make points (P, width) of a set.

        number : of the set
        inside : (P, coordinates) of its box of edges 1
        """
        points = np.zeros((len(inside), self.width))
        points[:, 0], points[:, 1 : 1 + inside.shape[1]] = number, inside
        return points

    @cached_property
    def lattice(self) -> Array:
        """Points (P, width) all over the sets."""
        return np.concatenate([self.make_points(i, poses.make_lattice()) for i, poses in enumerate(self.pose_sets)])

    @property
    def middle(self) -> Array:
        """The middle of the first set, (1, width): the home of designs, on whose side of singularities poses lie."""
        return self.make_points(0, np.full((1, len(self.pose_sets[0].coordinates)), 0.5))

    def place_poses(self, x: Array, points: Array) -> Array:
        """Place poses of designs x (..., variables) at points (P, width); (..., P, axes)."""
        still = np.empty((len(points), len(self.machine.axes)))
        for number, poses in enumerate(self.pose_sets):
            rows = points[:, 0] == number
            still[rows] = poses.place_rows(points[rows, 1:])
        return still + self.list_shifts(x)[..., None, :]

    def list_shifts(self, x: Array) -> Array:
        """List how far designs x (..., variables) move poses, (..., axes)."""
        moved = np.zeros((*x.shape[:-1], len(self.machine.axes)))
        for column, key in enumerate(self.shift, len(self.family.names)):
            for axis in key.split():
                moved[..., self.machine.axes.index(axis)] = x[..., column]
        return moved

    def move_sets(self, x: Array) -> tuple[PoseSet, ...]:
        """Move the sets to where a design x (variables,) has them."""
        shifts = dict(zip(self.shift, x[len(self.family.names) :].tolist(), strict=True))
        by = {axis: shift for key, shift in shifts.items() for axis in key.split()}
        return tuple(poses.move(by) for poses in self.pose_sets)

    def measure(self, x: Array, points: Array) -> Measures:
        """Measure designs x (S, variables) at points (P, width)."""
        poses = self.place_poses(x, np.concatenate([points, self.middle]))
        sizes = x[:, None, : len(self.family.names)]
        return Measures(self.tapes, poses, sizes, self.timer, self.list_shifts(x), self.gauge)

    def list_losses(self, name: str, x: Array, m: Measures) -> Array:
        """List a quantity or a free number of designs, (S, R), less is better; the greatest of a row counts.

        name : the quantity's or the number's
        m : what was measured of these designs
        """
        if name not in WANTS:
            return self.get_sign(name) * x[:, [self.variables.index(name)]]
        want = WANTS[name]
        values = want.measure(m)
        if want.spread:
            return np.asarray(values.max(1) - values.min(1))
        return want.sign * values.reshape(len(x), -1)
