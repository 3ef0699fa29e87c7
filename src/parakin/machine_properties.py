"""What a machine is: names and units of axes and joints, drives and legs, limits, home, working modes, wrist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import product

import numpy as np

from .algebra import Scalar
from .arguments import check_constructor, check_kind
from .arrays import Array, AxisRange
from .errors import DescriptionError, NoMethodError, PoseError, quote, suggest
from .kinematics.closure_roots import compute_closure_tolerance
from .kinematics.home import check_home
from .kinematics.wrist.pole_crossing import flip_mode
from .kinematics.wrist.pose_angles import EVERY_DIRECTION, EVERY_ROTATION, EVERY_TURN
from .kinematics.wrist.turning_joints import Wrist, find_wrist
from .model.elements import BodyBuild, Drive, PlaneConstraint, RodConstraint
from .model.equations import Equations
from .model.geometric_parameters import (
    SIZES,
    Parameter,
    list_parameters,
    replace_parameters,
    replace_ranges,
    settle_offsets,
)
from .model.legs import Inverse, Leg
from .model.limits import Limit, find_joined_struts, group_joints_by_leg
from .model.nominal_values import SizedTrace
from .model.rates import TwistRates, compute_twist_rates, list_closure_joints
from .model.size_rates import SizeRates, SpecMaker, find_size_rates, list_numbers
from .model.spec import Spec
from .model.structures import DirectionColumns, PlatformPlacement, Structure, make_structure
from .model.traces import Model
from .units import AXIS_UNITS

_SMALL_TURN = 1e-4  # rad, by which an angle is changed to see how numbers follow it


@check_constructor
class MachineProperties:
    """A machine's properties. Nothing of it changes once it is made.

    spec : its description
    make_spec : makes the description with other sizes of its file; None for one of no file
    model : its mathematics, for the library's own kinematics
    """

    def __init__(self, spec: Spec, make_spec: SpecMaker | None = None):
        self.spec, self._make_spec = spec, make_spec
        self.model = Model(spec)
        check_home(self.model)

    def __repr__(self) -> str:
        return f"<parakin machine {self.name}: axes {' '.join(self.axes)}, joints {' '.join(self.joints)}>"

    @property
    def name(self) -> str:
        """The name that its file gives."""
        return self.spec.name

    def format_yaml(self) -> str:
        """Format the machine as a machine file with every number explicit; reading it gives the same numbers."""
        from .description.writing import format_spec

        return format_spec(self.spec)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of a pose's coordinates after ISO 841: some of X Y Z, mm, and A B C, rad."""
        return self.model.axes

    @property
    def structure(self) -> Structure:
        """What motion, head and table make together."""
        return self.model.structure

    @property
    def has_direction(self) -> bool:
        """Whether B and C of a pose tell the tool's axis, and a turn about it does not count."""
        return self.structure.has_direction

    @property
    def direction(self) -> DirectionColumns | None:
        """The columns of B and C in a pose where these tell the tool's axis; None where a turn about it counts too.

        B and C of an axis are (8) and (9) of FME Transactions 41 (2013).
        """
        return self.structure.direction

    @property
    def orientation_ranges(self) -> dict[str, AxisRange]:
        """Ranges of the turning axes, rad, that hold every orientation once; a single one turns all round."""
        ranges = EVERY_DIRECTION if self.has_direction else EVERY_ROTATION
        turning = [axis for axis in self.axes if axis in ranges]
        return {axis: ranges[axis] if len(turning) > 1 else EVERY_TURN for axis in turning}

    @property
    def drives(self) -> tuple[Drive, ...]:
        """What can be driven, one for each joint."""
        return self.model.drives

    @property
    def legs(self) -> tuple[Leg, ...]:
        """The legs, each with its drives and what follows from their joints."""
        return self.spec.legs

    @property
    def bodies(self) -> Mapping[str, BodyBuild]:
        """What the machine's file says its bodies are made of, by their kinds."""
        return self.spec.bodies

    @property
    def constraints(self) -> tuple[PlaneConstraint | RodConstraint, ...]:
        """The closures without a drive."""
        return self.spec.constraints

    @property
    def passive_rods(self) -> dict[str, RodConstraint]:
        """The constraints that are rods, by their names."""
        return self.model.passive_rods

    @property
    def closure_joints(self) -> list[int]:
        """The joint of each leg's closure, as an index in the joint vector."""
        return list_closure_joints(self.spec)

    def group_joints(self, joints: Sequence[Scalar]) -> list[list[Scalar]]:
        """Group a joint vector (joints,) by leg, drives' offsets added; the joints of head and table are left out."""
        return group_joints_by_leg(self.spec, joints)

    @property
    def leg_count(self) -> int:
        """How many of the joints are the legs', the first ones; those of head and table follow."""
        return self.model.leg_count

    @property
    def parallel_block(self) -> tuple[int, int]:
        """How many rows and columns of A tell parallel singularities."""
        return self.model.parallel_block

    @property
    def is_redundant(self) -> bool:
        """Whether there are more drives than freedoms, so that the joints follow the pose and not it them."""
        return self.model.is_redundant

    def refuse_redundancy(self, what: str) -> None:
        """Raise :class:`NoMethodError` where there are more drives than freedoms, of what they decide together.

        what : the answer that is refused, in words
        """
        if self.is_redundant:
            counts = f"{len(self.joints)} drives for {len(self.axes)} freedoms"
            raise NoMethodError(f"{self.name}: no {what} of a machine that has {counts}, which work against each other")

    @property
    def leg_sizes(self) -> list[float]:
        """The length of the leg of each closure at home, mm."""
        return self.model.sizes

    @property
    def tool_length(self) -> float:
        """The length of the machine's own tool, mm: the shift along the tool's axis with which the head ends, or 0."""
        last = self.spec.head[-1] if self.spec.head else None
        fixed = last is not None and last.axis == "tz" and last.drive is None
        return max(0.0, -last.value) if last is not None and fixed else 0.0

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every number that can be an input, with its name, unit, value and group.

        First the named sizes of the machine's file that its numbers follow, then every geometric number.
        """
        spec, acting = self.spec, self.size_rates.acting
        named = (Parameter(name, spec.size_units[name], spec.sizes[name], SIZES) for name in acting)
        return (*named, *list_parameters(self.spec))

    def trace_equations(self, values: Mapping[str, Scalar], shifts: Mapping[str, Scalar] | None = None) -> Equations:
        """Trace the machine's equations with scalars of any kind in place of some of its :attr:`parameters`.

        values : scalars by the names of parameters, mm and rad
        shifts : what is added to parameters, mm and rad, once the others follow from ``values``
        """
        if not shifts:
            return Equations(self._replace_numbers(values)) if values else self.model
        named = {p.name: values.get(p.name, p.value) + shifts[p.name] for p in self.parameters if p.name in shifts}
        spec = self._replace_numbers({**values, **{name: x for name, x in named.items() if name in self.spec.sizes}})
        shifted = {p.name: p.value + shifts[p.name] for p in list_parameters(spec) if p.name in shifts}
        return Equations(replace_parameters(spec, shifted))

    # Kinematics on scalars of any kind (:mod:`parakin.algebra`), for interpreters such as intervals.

    def trace_inverse(self, pose: Sequence[Scalar], mode: str) -> tuple[list[Scalar], PlatformPlacement, list[Inverse]]:
        """Trace joints (joints,), the platform's placement, and each leg's inverse for a pose."""
        return self.model.invert(pose, mode)

    def trace_margins(self, pose: Sequence[Scalar], mode: str, joints: Sequence[Scalar] | None = None) -> list[Scalar]:
        """Trace every limit's margin, in the order of :attr:`limits`, for a pose and given joints or its inverse."""
        own = self.model.own_margins(pose, mode) if joints is None else self.model.margins(pose, joints, mode)
        return [margin for _, margin in own]

    def trace_common_point(self, joints: Sequence[Scalar]) -> tuple[list[Scalar], Scalar]:
        """Trace where the legs' spheres meet on home's side, and its squared height over their centres, mm²."""
        return self.model.trace_home_spheres(joints)

    def trace_rates(self, pose: Sequence[Scalar], joints: Sequence[Scalar]) -> TwistRates:
        """Trace A and B of the tool's twist, and the legs' wrench norms."""
        return compute_twist_rates(self.spec, self.structure, pose, joints)

    def trace_constraint_rates(self, pose: Sequence[Scalar]) -> list[list[Scalar]]:
        """Trace the rates of the constraints, as :meth:`constraint_rates`."""
        return self.model.trace_constraint_rates(pose)

    # Other numbers.

    def _replace_numbers(self, values: Mapping[str, Scalar]) -> Spec:
        """Replace named sizes, and all that follows from them, then single numbers."""
        spec = self.spec
        if any(name in values for name in spec.sizes):
            rates = self.size_rates
            sizes = zip(rates.names, rates.nominal, strict=True)
            spec = rates.apply(spec, [values.get(name, nominal) for name, nominal in sizes])
        return replace_parameters(spec, values)

    def list_follow_rates(self, size: str) -> dict[str, float]:
        """List the rates at which geometric numbers follow a named size, by their names; no others.

        size : a name of the file's ``sizes``; rates are mm or rad of the number for 1 mm or 1 rad of it
        """
        if size not in self.spec.sizes:
            raise PoseError(f"size: unknown {quote(size)}{suggest(size, self.spec.sizes)}")
        value, step = self.spec.sizes[size], 1.0 if self.spec.size_units[size] == "mm" else _SMALL_TURN
        after, before = (list_parameters(self._replace_numbers({size: value + way * step})) for way in (1.0, -1.0))
        ends = zip(after, before, strict=True)
        return {new.name: 0.5 * (new.value - old.value) / step for new, old in ends if new.value != old.value}

    def _make_other_spec(
        self,
        values: Mapping[str, float],
        ranges: Mapping[str, AxisRange],
        home: Mapping[str, float],
        sizes: Mapping[str, float],
    ) -> Spec:
        """Make the description with other numbers, ranges of drives and home, and then other named sizes.

        Struts that meet in a joint with these named sizes go on meeting there: single numbers tell how far it is off.
        """
        values = {**values, **sizes}
        spec = self._replace_numbers(values)
        if spec.limits.clearance is not None and any(name not in spec.sizes for name in values):
            described = self._replace_numbers({name: x for name, x in values.items() if name in spec.sizes})
            spec = replace(spec, limits=replace(spec.limits, joined=find_joined_struts(described)))
        named = {name: values.get(name, value) for name, value in spec.sizes.items()}
        spec = replace_ranges(replace(spec, sizes=named, home={**spec.home, **home}), ranges)
        return settle_offsets(spec)

    @cached_property
    def size_rates(self) -> SizeRates:
        """How the machine's numbers follow the named sizes of its file; none for one of no file.

        There are none either where constraints are solved in steps; a size without which they are not is left out.
        """
        if self._make_spec is None or self.structure.is_solved:
            return SizeRates((), (), (), (), ((),) * len(list_numbers(self.spec)), ())
        return find_size_rates(self.spec, self._make_spec if self.spec.constraints == () else self._make_closed_spec)

    @cached_property
    def fixed_sizes(self) -> tuple[str, ...]:
        """Names of the file's sizes that are no inputs: numbers follow them in no way that :attr:`size_rates` knows."""
        return tuple(name for name in self.spec.sizes if name not in self.size_rates.names)

    def _make_closed_spec(self, sizes: Mapping[str, float]) -> Spec:
        """Make the description with other sizes, where its constraints have a closed form there too."""
        assert self._make_spec is not None
        spec = self._make_spec(sizes)
        if make_structure(spec).is_solved:
            raise DescriptionError("sizes", "the constraints have a closed form with the file's sizes only")
        return spec

    def trace_sized_equations(self, trace: SizedTrace) -> Equations:
        """Trace the machine's equations with the sizes of :attr:`size_rates` as inputs of a trace.

        trace : has one input for each of these sizes, mm or rad, in their order
        """
        return Equations(self.size_rates.apply(self.spec, trace.sizes))

    @cached_property
    def wrist(self) -> Wrist | None:
        """The two turning joints of head and table that point the tool; None where there are no two."""
        return find_wrist(self.model)

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the joint vector's entries: the legs', then head's and table's."""
        return tuple(drive.name for drive in self.model.drives)

    @cached_property
    def joint_units(self) -> tuple[str, ...]:
        """``mm`` or ``rad`` for each joint."""
        return tuple(drive.unit for drive in self.model.drives)

    @property
    def axis_units(self) -> tuple[str, ...]:
        """``mm`` or ``rad`` for each axis."""
        return tuple(AXIS_UNITS[axis] for axis in self.axes)

    @property
    def turning_columns(self) -> list[int]:
        """Columns of a pose that are angles."""
        return self.model.turning_columns

    @property
    def turning_joints(self) -> list[int]:
        """Columns of a joint vector that are angles, legs' too."""
        return self.model.turning_joints

    @cached_property
    def limits(self) -> tuple[str, ...]:
        """Names of all limits, in the order of :meth:`margins`."""
        return tuple(limit.name for limit in self.limit_definitions)

    @property
    def limit_definitions(self) -> tuple[Limit, ...]:
        """All limits, with name, subject, unit, side and bound."""
        return self.model.limits

    @cached_property
    def home(self) -> Array:
        """A pose in the middle of the workspace, (axes,), mm and rad; it can't be written to."""
        home = np.array(self.model.home)
        home.flags.writeable = False
        return home

    @property
    def mode(self) -> str:
        """The default working mode: a sign for each choice of the inverse, legs first, then head and table."""
        return self.model.mode

    @cached_property
    def modes(self) -> tuple[str, ...]:
        """All working modes, the default one first."""
        signs = [sign if i in self.fixed_signs else "+-" for i, sign in enumerate(self.mode)]
        every = ["".join(choice) for choice in product(*signs)]
        return (self.mode, *[mode for mode in every if mode != self.mode])

    def head_modes(self, mode: str) -> list[str]:
        """Return a working mode, and the one with the other sign of head and table, if these have a choice."""
        mode = self.checked_mode(mode)
        return [mode, flip_mode(mode)] if self.structure.branches else [mode]

    def checked_mode(self, mode: str | None) -> str:
        """Return a working mode, the default one for None; raises :class:`PoseError` for an invalid one."""
        if mode is None:
            return self.mode
        check_kind("mode", mode, str, f" such as {self.mode!r}")
        if mode not in self.modes:
            raise PoseError(f"mode {mode!r}: one of {', '.join(repr(m) for m in self.modes[:8])} expected")
        return mode

    @property
    def fixed_signs(self) -> list[int]:
        """Places of the signs in :attr:`mode` that no other mode has otherwise."""
        return self.model.fixed_signs

    @property
    def closure_tolerance(self) -> float:
        """The greatest distance by which a leg may fail to close in an answer of :meth:`forward`, mm."""
        return compute_closure_tolerance(self.model)

    @property
    def has_closed_forward(self) -> bool:
        """Whether the direct problem is the common point of spheres or circles."""
        return self.model.by_spheres

    @property
    def home_side(self) -> float:
        """The side of the spheres' centres on which the platform is at home, 1 or -1."""
        return self.model.home_side
