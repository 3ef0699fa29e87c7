"""Find the generic members of the shipped machines' families by monodromy, and store them with the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import parakin as pk
from parakin.kinematics.assemblies import generic_member
from parakin.kinematics.assemblies.quadric_family import make_family


def describe_members(members: dict[tuple[str, ...], generic_member.GenericMember]) -> dict[str, np.ndarray]:
    """The file's arrays: for each motion the quadrics (n - 1, 8, 8) and roots (k, 8) in Study's coordinates."""
    arrays = {}
    for motion, member in members.items():
        hull, name = make_family(motion).hull, "_".join(motion)
        arrays[name] = hull.T @ member.system @ hull
        arrays[f"{name}_roots"] = member.roots @ hull
    return arrays


def main() -> None:
    motions = sorted({tuple(pk.load(name).model.spec.motion) for name in pk.machines()})
    members = {motion: generic_member.search_generic_member(motion) for motion in motions}
    for motion, member in members.items():
        print(f"{' '.join(motion)}: {len(member.roots)} roots")
    folder = Path(generic_member.__file__).parent
    np.savez(folder / "generic_members.npz", **describe_members(members))


if __name__ == "__main__":
    main()
