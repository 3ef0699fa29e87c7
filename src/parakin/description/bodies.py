"""The section of a machine file that says what the bodies are made of."""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, ClassVar

from pydantic import model_validator

from ..model.elements import BodyBuild
from ..units import DENSITY, MASS, MODULUS, NUMBER
from .sections import FileSection
from .values import Extent, accept_quantity

_Density = Annotated[float, accept_quantity(DENSITY)]
_Mass = Annotated[float, accept_quantity(MASS)]
_Modulus = Annotated[float, accept_quantity(MODULUS)]
_Count = Annotated[float, accept_quantity(NUMBER, (0.0, 9.0, "1 to 9"))]


class _BodySection(FileSection):
    """Bodies of a kind."""

    where: ClassVar[str] = " in bodies"

    density: _Density | None = None
    diameter: Extent | None = None
    wall: Extent | None = None
    mass: _Mass | None = None

    @model_validator(mode="after")
    def _check_wall(self) -> _BodySection:
        if self.wall is not None and (self.diameter is None or not self.wall <= 0.5 * self.diameter):
            raise ValueError("a wall is of a tube, expected a diameter of at least twice as much beside it")
        return self

    def build(self) -> BodyBuild:
        known = {spec.name for spec in fields(BodyBuild)}
        given = {name: value for name, value in self if value is not None and name in known}
        return BodyBuild(**(given | {"rods": int(given.get("rods", 1))}))


class _BarSection(_BodySection):
    modulus: _Modulus | None = None
    rods: _Count = 1.0

    @model_validator(mode="after")
    def _check_count(self) -> _BarSection:
        if self.rods != int(self.rods):
            raise ValueError("rods: a whole number from 1 to 9 expected")
        return self


class BodiesSection(FileSection):
    """What the bodies are made of, by their kinds."""

    where: ClassVar[str] = " in bodies"

    rod: _BarSection | None = None
    carriage: _BodySection | None = None
    platform: _BodySection | None = None
    head: _BodySection | None = None
    table: _BodySection | None = None

    def build(self) -> dict[str, BodyBuild]:
        """Build what is stated, by kinds."""
        return {kind: section.build() for kind, section in self if section is not None}
