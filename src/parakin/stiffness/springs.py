"""The springs of a machine: its drives, and its struts from their section or as they are given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from math import pi
from typing import NamedTuple, TypeAlias

import numpy as np

from ..algebra import Scalar, absolute, add, sqrt
from ..arrays import Array
from ..errors import PoseError, quote, suggest
from ..families.shift_rates import trace_shift_rates
from ..machine import Machine
from ..model.legs import Leg
from ..units import (
    ANGULAR_STIFFNESS,
    LENGTH,
    MODULUS,
    STIFFNESS,
    QuantityError,
    QuantityKind,
    evaluate_expression,
    parse_quantity,
)

RIGID = "rigid"
_STEEL = "210 GPa"

_LEAST, _GREATEST = 1e-30, 1e30  # N, N/mm, Nmm/rad and MPa: sums of their squares do not overflow


class Section(NamedTuple):
    """A strut's section.

    area : mm²
    second_moment : of area, mm⁴
    modulus : of elasticity, N/mm²
    """

    area: float
    second_moment: float
    modulus: float


Struts: TypeAlias = Section | float | None  # a section, N/mm of each rod, or None: they are rigid


class MachineSprings(NamedTuple):
    """The springs of a machine.

    drives : (joints,) compliances, mm/N or rad/Nmm
    struts : their section, or the stiffness of each rod, N/mm; None: they are rigid
    """

    drives: Array
    struts: Struts

    def __repr__(self) -> str:
        of_section = "of a section" if isinstance(self.struts, Section) else f"of {self.struts} N/mm"
        struts = "rigid" if self.struts is None else of_section
        soft = np.count_nonzero(self.drives)
        return f"<parakin springs: {soft} of {len(self.drives)} drives give way, struts {struts}>"


class Spring(NamedTuple):
    """A spring at a pose; scalars of any kind.

    moved : (n,) what a unit of its give adds to the closures' right side
    compliance : mm/N or rad/Nmm
    """

    moved: Sequence[Scalar]
    compliance: Scalar


def parse_positive(text: str, kind: QuantityKind, name: str) -> float:
    """Parse a number above zero with its unit.

    Raises :class:`PoseError`.
    """
    try:
        value = parse_quantity(text, kind)
    except QuantityError as error:
        raise PoseError(f"{name}: {error}") from None
    if not value > 0.0:
        raise PoseError(f"{name}: {quote(text)}, expected more than 0")
    if not _LEAST < value < _GREATEST:
        raise PoseError(f"{name}: {quote(text)} is out of range")
    return value


def read_struts(struts: Mapping[str, str] | str | None) -> Struts:
    """Read the struts' stiffness: ``"300 N/um"``, ``"rigid"``, or a section's words.

    Words: ``diameter``, of round bars and tubes; ``wall``, a tube's thickness; ``modulus``, by default steel's;
    ``rods``, how many stand side by side in a strut (2 in a parallelogram), by default 1.

    Raises :class:`PoseError`.
    """
    if struts is None or struts == RIGID:
        return None
    if isinstance(struts, str):
        return parse_positive(struts, STIFFNESS, "struts")
    words = ("diameter", "wall", "modulus", "rods")
    for word, text in struts.items():
        if word not in words:
            raise PoseError(f"struts: unknown {quote(word)}{suggest(word, words)}")
        if not isinstance(text, str):
            raise PoseError(f"struts: {word} is a text with its unit, such as 40 mm")
    if "diameter" not in struts:
        raise PoseError("struts: the diameter is missing")
    outer = parse_positive(struts["diameter"], LENGTH, "struts: diameter")
    wall = parse_positive(struts["wall"], LENGTH, "struts: wall") if "wall" in struts else 0.5 * outer
    if wall > 0.5 * outer:
        raise PoseError("struts: the wall is thicker than half the diameter")
    count = struts.get("rods", "1")
    if not (count.isascii() and count.isdigit() and 1 <= int(count) <= 9):
        raise PoseError(f"struts: rods of {quote(count)}, expected 1 to 9")
    modulus = parse_positive(struts.get("modulus", _STEEL), MODULUS, "struts: modulus")
    return _make_section(outer, 2.0 * wall, int(count), modulus)


def _read_one_of(text: str, kind: QuantityKind, name: str) -> float:
    """Read the compliance of a drive from the one of some stiffnesses that is of its kind."""
    words = [word.strip() for word in text.split(",")]
    own = [word for word in words if word != RIGID and _is_of_kind(word, kind)]
    if len(own) > 1:
        raise PoseError(f"drives: {own[0]} and {own[1]} for all, expected them by names: d*=100N/um")
    word = own[0] if own else words[0] if RIGID not in words else RIGID
    return 0.0 if word == RIGID else 1.0 / parse_positive(word, kind, f"drives: {name}")


def _is_of_kind(text: str, kind: QuantityKind) -> bool:
    try:
        return evaluate_expression(text).dimension == kind.dimension
    except QuantityError:
        return False


def _read_stated_drives(machine: Machine) -> Array:
    """Read the compliances that the machine's file says."""
    for drive in machine.drives:
        if drive.stiffness is None:
            raise PoseError(f"drives: the machine's file says no stiffness of {drive.name}, expected one here")
    return np.array([1.0 / drive.stiffness for drive in machine.drives if drive.stiffness is not None])


def _find_stated_section(machine: Machine) -> Section | None:
    """Find the struts' section that the machine's file says; without one they are rigid."""
    rod = machine.bodies.get("rod")
    if rod is None or rod.diameter is None:
        return None
    modulus = parse_positive(_STEEL, MODULUS, "modulus") if rod.modulus is None else rod.modulus
    return _make_section(rod.diameter, rod.diameter if rod.wall is None else 2.0 * rod.wall, rod.rods, modulus)


def _make_section(outer: float, walls: float, rods: int, modulus: float) -> Section:
    """Make the section of round bars side by side; ``walls`` is twice the thickness of a tube's wall."""
    inner = outer - walls
    area, second = pi * (outer**2 - inner**2) / 4.0, pi * (outer**4 - inner**4) / 64.0
    return Section(rods * area, rods * second, modulus)


def read_drives(machine: Machine, drives: Mapping[str, str] | str | None) -> Array:
    """Read each drive's compliance, (joints,) mm/N or rad/Nmm: a stiffness by names and patterns, or for all.

    None takes those of the machine's file.

    The one for all may be two, of drives along and of drives about their joints: ``100 N/um, 200 kNm/rad``.

    Raises :class:`PoseError` for a drive without one; ``rigid`` is one.
    """
    if drives is None:
        return _read_stated_drives(machine)
    if isinstance(drives, str):
        kinds = [ANGULAR_STIFFNESS if unit == "rad" else STIFFNESS for unit in machine.joint_units]
        return np.array([_read_one_of(drives, kind, name) for name, kind in zip(machine.joints, kinds, strict=True)])
    stated = drives
    used: set[str] = set()
    result = []
    for name, unit in zip(machine.joints, machine.joint_units, strict=True):
        fits = [pattern for pattern in stated if fnmatchcase(name, pattern)]
        own = max(fits, key=lambda pattern: (pattern == name, len(pattern)), default=None)
        if own is None:
            raise PoseError(f"drives: {name} has no stiffness; {RIGID} is one")
        used |= set(fits)
        text = stated[own]
        if not isinstance(text, str):
            raise PoseError("drives: a text with its unit expected, such as 100 N/um")
        kind = ANGULAR_STIFFNESS if unit == "rad" else STIFFNESS
        result.append(0.0 if text == RIGID else 1.0 / parse_positive(text, kind, f"drives: {name}"))
    for pattern in stated:
        if pattern not in used:
            raise PoseError(f"drives: unknown {quote(pattern)}{suggest(pattern, machine.joints)}")
    return np.array(result)


class StrutScalars(NamedTuple):
    """What a leg's springs are made from, at a pose; scalars of any kind.

    leg : the leg
    joints : of the leg
    by_drive : for each drive what a unit of it adds to the closures' right side (n,)
    by_size : the same by a size of the leg
    """

    leg: Leg
    joints: Sequence[Scalar]
    by_drive: Sequence[Sequence[Scalar]]
    by_size: Callable[[str], list[Scalar]]


def _list_length(at: StrutScalars, struts: Section | float) -> list[Spring]:
    own = 1.0 / struts if isinstance(struts, float) else absolute(at.joints[0]) / (struts.modulus * struts.area)
    return [Spring(at.by_drive[0], own)]


def _list_rod(at: StrutScalars, struts: Section | float) -> list[Spring]:
    rod = getattr(at.leg, "rod")  # noqa: B009  - a size of these kinds
    own = 1.0 / struts if isinstance(struts, float) else rod / (struts.modulus * struts.area)
    return [Spring(at.by_size("rod"), own)]


def _list_lambda(at: StrutScalars, struts: Section | float) -> list[Spring]:
    """List the springs of a lambda leg: both parts of the long rod, and the short rod, which bends the long one.

    The hinge gives way across the long rod, a beam on two supports, by P a² b² / (3 E I L). That moves the short rod's
    end along it, so it is in line with its own spring.
    """
    assert isinstance(struts, Section)  # read_springs refuses others
    long, short, hinge = (getattr(at.leg, size) for size in ("long", "short", "hinge"))
    lower, stretch = long - hinge, 1.0 / (struts.modulus * struts.area)
    gap = at.joints[1] - at.joints[0]
    cosine = (lower * lower + short * short - gap * gap) / (2.0 * lower * short)
    across = lower * hinge
    bending = across * across / (3.0 * struts.modulus * struts.second_moment * long)
    by_long, by_hinge = at.by_size("long"), at.by_size("hinge")
    return [
        Spring(by_long, lower * stretch),
        Spring(add(by_long, by_hinge), hinge * stretch),
        Spring(at.by_size("short"), short * stretch + (1.0 - cosine * cosine) * bending),
    ]


_KINDS = {"length": _list_length, "ring": _list_length, "slider": _list_rod, "crank": _list_rod, "lambda": _list_lambda}


def read_springs(
    machine: Machine, drives: Mapping[str, str] | str | None, struts: Mapping[str, str] | str | None
) -> MachineSprings:
    """Read a machine's springs; see :func:`read_drives` and :func:`read_struts`.

    Raises :class:`PoseError`, also for struts that carry more than what their springs tell.
    """
    own = _find_stated_section(machine) if struts is None else read_struts(struts)
    springs = MachineSprings(read_drives(machine, drives), own)
    if springs.struts is None and not springs.drives.any():
        raise PoseError("drives: all are rigid, and so are the struts")
    for leg in machine.legs:
        if springs.struts is not None and leg.kind not in _KINDS:
            raise PoseError(f"struts: those of kind {leg.kind} bend, which is not told; leave struts out")
        if isinstance(springs.struts, float) and leg.kind == "lambda":
            raise PoseError("struts: the short rod bends the long one, so a section is needed: diameter, wall")
    return springs


def trace_springs(
    machine: Machine, pose: Sequence[Scalar], springs: MachineSprings, sizes: Mapping[str, Scalar]
) -> tuple[list[list[Scalar]], list[list[Spring]]]:
    """Trace A of the tool's twist at a pose, scalars of any kind, and the springs: drives', then each leg's struts'.

    sizes : other values of the machine's parameters, by name
    """
    equations = machine.trace_equations(sizes)
    joints, _, _ = equations.invert(pose, machine.mode)
    rods = [] if springs.struts is None else [p.name for p in machine.parameters if p.group == "rods"]
    a, b, c = trace_shift_rates(machine, pose, joints, rods, sizes)
    by_joint = [list(column) for column in zip(*b, strict=True)]
    result = [[Spring(column, own) for column, own in zip(by_joint, springs.drives.tolist(), strict=True)]]
    given = equations.group_joints(joints)
    for leg, own in zip(equations.legs, given, strict=True) if springs.struts is not None else ():
        drives = [by_joint[machine.joints.index(drive.name)] for drive in leg.drives]

        def list_slopes(size: str, name: str = leg.drives[0].name) -> list[Scalar]:
            column = rods.index(f"legs.{name}.{size}")
            return [-row[column] for row in c]

        assert springs.struts is not None
        result.append(_KINDS[leg.kind](StrutScalars(leg, own, drives, list_slopes), springs.struts))
    return a, result


def trace_compliance(
    machine: Machine, pose: Sequence[Scalar], springs: MachineSprings, sizes: Mapping[str, Scalar]
) -> tuple[list[list[Scalar]], list[list[Scalar]]]:
    """Trace A of the tool's twist, and W such that A⁻¹W (A⁻¹W)ᵀ is the tool's compliance."""
    a, groups = trace_springs(machine, pose, springs, sizes)
    soft = [spring for group in groups for spring in group if spring.compliance != 0.0]
    columns = [[x * sqrt(spring.compliance) for x in spring.moved] for spring in soft]
    return a, [list(row) for row in zip(*columns, strict=True)]
