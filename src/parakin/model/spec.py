"""The description of a machine: a platform with a known motion, held by legs; a head, a table, limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .elements import BodyBuild, Drive, Limits, PlaneConstraint, RodConstraint, Step, Unit
from .legs import Leg


@dataclass(frozen=True)
class Spec:
    """A machine's description with every size resolved (mm, rad).

    ``motion`` lists the platform's elementary transforms in order (``tx ty tz rx ry rz``); ``mounting`` places the
    base frame in the machine frame; ``head`` leads from the platform to the tool's tip, whose +z points from the tip
    into the holder; ``table`` leads from the machine frame to the workpiece. ``home`` maps axis names to a pose.
    ``size_units`` has those of the ``sizes`` that are lengths or angles.
    ``bodies`` tells what bodies of some kinds are made of: ``rod``, ``carriage``, ``platform``, ``head``, ``table``.
    ``parasitic`` are the words of the motion that follow from the others by the ``constraints``.
    """

    name: str
    title: str
    source: str
    motion: tuple[str, ...]
    legs: tuple[Leg, ...]
    home: Mapping[str, float]
    sizes: Mapping[str, float] = field(default_factory=dict)
    mounting: tuple[Step, ...] = ()
    head: tuple[Step, ...] = ()
    table: tuple[Step, ...] = ()
    limits: Limits = field(default_factory=Limits)
    parasitic: tuple[str, ...] = ()
    constraints: tuple[PlaneConstraint | RodConstraint, ...] = ()
    size_units: Mapping[str, Unit] = field(default_factory=dict)
    bodies: Mapping[str, BodyBuild] = field(default_factory=dict)

    @property
    def drives(self) -> tuple[Drive, ...]:
        """Every drive in the order of the joint vector: the legs' first ones, their second ones, head, table."""
        most = max((len(leg.drives) for leg in self.legs), default=0)
        legs = [leg.drives[i] for i in range(most) for leg in self.legs if i < len(leg.drives)]
        serial = [step.drive for step in (*self.head, *self.table) if step.drive is not None]
        return (*legs, *serial)

    @property
    def family(self) -> str:
        """The families of its legs in words."""
        return ", ".join(dict.fromkeys(leg.family for leg in self.legs))

    def __repr__(self) -> str:
        return f"<parakin description of {self.name}: {len(self.legs)} legs>"
