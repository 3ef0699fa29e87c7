"""The tool's stiffness from the springs of drives and struts, by virtual work."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..algebra import Scalar
from ..arguments import RowsLike, check_arguments, read_rows
from ..arrays import Array
from ..dynamics.inverse_dynamics import Dynamics
from ..errors import PoseError
from ..families.family import Family, solve_each
from ..kinematics.tall_matrices import invert_from_left
from ..machine import Machine
from ..workspaces.sampled.allowed_poses import SAMPLES, choose_poses
from .springs import MachineSprings, read_springs, trace_springs


@dataclass(frozen=True, eq=False)
class Stiffness:
    """The tool's compliance at poses, in the machine's own freedoms: what guides the platform is rigid.

    machine : the one that was analysed
    poses, joints : (N, axes), (N, joints), mm and rad
    compliances : (N, n, n) of the tool's twist (the tip's translations, mm, then small turns of the tool, rad) by
        forces, N, and moments, Nmm, at the tip; NaN where a pose is out of reach or singular
    drive_share : (N,) of the tip's compliance that is the drives'; the rest is the struts'
    springs : what it was analysed with
    """

    machine: Machine
    poses: Array
    joints: Array
    compliances: Array
    drive_share: Array
    springs: MachineSprings

    def __repr__(self) -> str:
        return (
            f"<parakin stiffness of {self.machine.name}: {len(self.poses)} poses, at least {self.least.min():.4g} N/mm>"
        )

    @property
    def translations(self) -> tuple[str, ...]:
        """The t axes along which the tip moves."""
        return tuple(axis for axis in self.machine.axes if axis in "XYZ")

    @property
    def matrices(self) -> Array:
        """The stiffness matrices, (N, n, n): N/mm, N/rad, Nmm/rad; NaN where the tool is rigid in some direction."""
        size, tip = max(self.machine.leg_sizes), len(self.translations)
        factors = np.where(np.arange(self.compliances.shape[1]) < tip, 1.0, size)  # to mm and N
        scaled = np.nan_to_num(self.compliances * factors[:, None] * factors)
        good = np.linalg.matrix_rank(scaled, hermitian=True) == len(factors)
        result = np.full_like(self.compliances, np.nan)
        result[good] = np.linalg.inv(scaled[good]) * factors[:, None] * factors
        return result

    @property
    def _tip(self) -> Array:
        tip = len(self.translations)
        return self.compliances[:, :tip, :tip]

    @property
    def least(self) -> Array:
        """The least stiffness of the tip over all directions of a force, (N,) N/mm: force by the tip's whole way."""
        result = np.full(len(self.poses), np.nan)
        good = np.isfinite(self._tip).all((1, 2))
        with np.errstate(divide="ignore"):
            result[good] = 1.0 / np.linalg.norm(self._tip[good], 2, axis=(1, 2))
        return result

    def along(self, direction: RowsLike) -> Array:
        """Compute the tip's stiffness along a direction, (N,) N/mm: a force along it by the tip's way along it.

        direction : along the pose's axes, by :attr:`translations`, (t,) or a dict, of any length

        Raises :class:`PoseError` for one without a length.
        """
        row = read_rows(direction, self.translations, ["mm"] * len(self.translations), self._rest, "direction")
        size = np.linalg.norm(row, axis=-1, keepdims=True)
        if not (size > 0.0).all():
            raise PoseError("direction: it has no length")
        unit = np.broadcast_to(row / size, (len(self.poses), len(self.translations)))
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / np.einsum("ni,nij,nj->n", unit, self._tip, unit))

    def deflect(self, force: RowsLike) -> Array:
        """Compute how the tool gives way to a force on its tip, (N, n): the twist, mm and rad.

        force : N by the translations, along the pose's axes: one (t,), a row a pose (N, t), or a dict

        Raises :class:`PoseError` for more or less rows than poses.
        """
        tip = len(self.translations)
        rows = read_rows(force, self.translations, ["mm"] * tip, self._rest, "force")
        if rows.shape not in ((tip,), (len(self.poses), tip)):
            raise PoseError(f"force: one, or as many as the {len(self.poses)} poses, expected")
        rows = np.broadcast_to(rows, (len(self.poses), tip))
        return np.asarray(np.einsum("nij,nj->ni", self.compliances[:, :, :tip], rows))

    def sag(self) -> Array:
        """Compute how the machine's own weight moves the tool, (N, n): the twist, mm and rad.

        The masses are those of :func:`parakin.compute_drive_forces`; struts are held at both ends, so none of their own
        weight bends them.

        With more drives than freedoms all springs together share the weight, so that the energy is least.
        """
        a, springs = _list_springs(self.machine, self.poses, self.springs)
        weight = Dynamics(self.machine).compute_weight_rates(self.poses, self.joints)
        sizes = np.array(self.machine.leg_sizes)[:, None]
        of_legs = [own._replace(moved=own.moved[:, : self.machine.leg_count] / sizes) for own in springs]
        of_legs[0] = springs[0]._replace(moved=weight.by_drives)
        total = np.zeros(self.compliances.shape[:2])
        for number, own in enumerate(springs):
            ways = _find_ways(weight.slopes, of_legs, of_legs[number].moved)
            rates = np.einsum("nis,ni->ns", ways, weight.by_coordinates)
            if number == 0:  # the drives move bodies of their own
                rates += weight.by_joints
            total -= np.einsum("nis,ns->ni", _find_ways(a, springs, own.moved), own.compliances * rates)
        return total

    def load(self, force: RowsLike | None = None) -> Stiffness:
        """Compute the stiffness of the machine that weight and a force on the tip load at these poses.

        force : N by the translations, (t,) or a dict; by default none

        The loads keep their directions, so what they do changes with the geometry: their potential's Hessian stands
        beside the springs'. NaN where the machine gives way without bound.

        Raises :class:`PoseError` for struts whose springs are not along their drives, of kinds other than ``length``,
        :class:`NoMethodError` for a machine with more drives than freedoms.
        """
        self.machine.refuse_redundancy("stiffness under load")
        acting = self._rest()
        if force is not None:
            acting = read_rows(force, self.translations, ["mm"] * len(acting), self._rest, "force")
        if acting.shape != self._rest().shape or not np.isfinite(acting).all():
            raise PoseError(f"force: one number each for {' '.join(self.translations)} expected")
        machine, compliance = self.machine, np.zeros_like(self.joints)
        a, (drives, *struts) = _list_springs(machine, self.poses, self.springs)
        compliance += drives.compliances
        for leg, own in zip(machine.legs, struts, strict=False):
            if leg.kind not in ("length", "ring"):
                raise PoseError(f"struts: loads on those of kind {leg.kind} are not told, expected rigid ones")
            compliance[:, machine.joints.index(leg.drives[0].name)] += own.compliances[:, 0]
        rates = Dynamics(machine).compute_load_rates(self.poses, self.joints, acting)
        ways, softer = solve_each(a, drives.moved), np.eye(rates.shape[1]) + compliance[:, :, None] * rates
        inverse = solve_each(softer, compliance[:, :, None] * np.eye(rates.shape[1]))
        loaded = ways @ inverse @ ways.transpose(0, 2, 1)
        steady = np.linalg.eigvals(np.where(np.isfinite(softer), softer, 0.0)).real.min(axis=1) > 0.0
        return replace(self, compliances=np.where(steady[:, None, None], loaded, np.nan))

    def _rest(self) -> Array:
        return np.zeros(len(self.translations))


@check_arguments
def analyse_stiffness(
    machine: Machine,
    drives: Mapping[str, str] | str | None = None,
    struts: Mapping[str, str] | str | None = None,
    poses: RowsLike | None = None,
    samples: int = SAMPLES,
) -> Stiffness:
    """Analyse the tool's stiffness where drives and struts are springs, for small forces on an unloaded machine.

    machine : what it holds without a drive is rigid
    drives : ``"100 N/um"`` for all, or by names and patterns, ``{"d*": "100 N/um", "theta*": "20 kNm/rad"}``; each
        drive needs one, which may be ``rigid``; of slides and motors together, along or about the joint. By default
        what the machine's file says
    struts : each rod's stiffness along it, ``"300 N/um"``; or its section, ``{"diameter": "40 mm", "wall": "5 mm",
        "modulus": "210 GPa", "rods": "2"}``. By default what the machine's file says of its ``rod`` bodies, else they
        are rigid
    poses : (N, axes), mm and rad; by default as many as ``samples`` all over the workspace, clear of singularities

    By virtual work: springs that give by s move the tool by t = J s, with A J = (B, -C) of the closures' derivatives by
    drives and sizes; the forces on them are Jᵀ w, so the compliance is J c Jᵀ. With more drives than freedoms the tool
    is where all springs together hold the least energy; NaN where rigid ones can't give way together. Arms of cranks
    count as rigid, and so does all that holds the platform without a drive (central legs, constraints, a
    parallelogram's hold of the orientation).

    Raises :class:`PoseError` for a stiffness without a unit or not above zero, and for a drive without one.
    """
    springs = read_springs(machine, drives, struts)
    rows = choose_poses(machine, poses, samples)
    return compute_stiffness(machine, rows, springs)


def compute_stiffness(machine: Machine, poses: Array, springs: MachineSprings) -> Stiffness:
    """Compute the stiffness at rows of poses."""
    joints = machine.inverse(poses)
    a, listed = _list_springs(machine, poses, springs)
    by_kind = []
    for one in listed:
        ways = _find_ways(a, listed, one.moved)
        by_kind.append(np.einsum("nis,ns,njs->nij", ways, one.compliances, ways))
    total = np.sum(by_kind, axis=0)
    tip = sum(axis in "XYZ" for axis in machine.axes)
    of_drives, of_all = (np.trace(own[:, :tip, :tip], axis1=1, axis2=2) for own in (by_kind[0], total))
    with np.errstate(invalid="ignore", divide="ignore"):
        return Stiffness(machine, poses, joints, total, of_drives / of_all, springs)


class Springs(NamedTuple):
    """Springs at poses.

    moved : (N, closures, s) what a unit of each spring's give adds to the closures' right side
    compliances : (N, s), mm/N or rad/Nmm
    """

    moved: Array
    compliances: Array


def _find_ways(a: Array, springs: list[Springs], moved: Array) -> Array:
    """Find how the tool follows what the springs give: A t' = M s', of a tall A where all springs hold least energy."""
    if a.shape[1] == a.shape[2]:
        return solve_each(a, moved)
    metric = np.concatenate([own.moved * np.sqrt(own.compliances)[:, None] for own in springs], 2)
    return invert_from_left(a, metric) @ moved


def _list_springs(machine: Machine, poses: Array, springs: MachineSprings) -> tuple[Array, list[Springs]]:
    """List A, and the springs of all drives, then those of each leg's struts."""
    n, m, sizes = len(machine.axes), len(machine.joints), list[int]()

    def list_outputs(pose: list[Scalar], own: Mapping[str, Scalar]) -> list[Scalar]:
        a, groups = trace_springs(machine, pose, springs, own)
        sizes.extend(len(group) for group in groups)
        moved = [x for group in groups for row in zip(*(s.moved for s in group), strict=True) for x in row]
        return [*(x for row in a for x in row), *moved, *(s.compliance for group in groups for s in group)]

    rows = Family(machine, ()).evaluate("springs", list_outputs, poses, ())
    edges = np.cumsum([m * n, *(m * size for size in sizes), *sizes])[:-1]
    a, *columns = np.split(rows, edges, axis=1)
    moved, compliances = columns[: len(sizes)], columns[len(sizes) :]
    groups = zip(sizes, moved, compliances, strict=True)
    return a.reshape(-1, m, n), [Springs(own.reshape(-1, m, size), c) for size, own, c in groups]
