"""Count all solutions of random general platforms: forty complex ones each, the same as PHCpack's where asked.

``python sweep_platforms.py FIRST LAST LOG`` takes seeds FIRST to LAST - 1 and adds a line to LOG for each; what the log
has already is not run again. With ``phc`` behind it PHCpack tracks its own forty solutions to each platform too, again
with another phase where two of its paths met; ours are then matched one to one with them, the complex ones as well.
With ``systems`` behind it the same platforms are systems of quadrics only, tracked from the family's generic member a
hundred at a time, which takes a fraction of the time of a machine each.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from independent import orientation
from phcpack import describe_closures, match_points, measure_angles, track_by_phcpack
from test_continuation import draw_platform, platform

from parakin.kinematics.assemblies.generic_member import find_generic_member
from parakin.kinematics.assemblies.path_tracking import STRICT, align_members, find_meetings, track_members
from parakin.kinematics.assemblies.quadric_family import make_family
from parakin.kinematics.assemblies.study import compute_study_points, make_closure_quadrics

ALL = 40
SAME = 1e-6  # rad, in Study's parameters in m
BLOCK = 100
FREE = ("tx", "ty", "tz", "rz", "ry", "rx")


def draw_posed(seed):
    """Feet, corners and a pose that the seed draws."""
    rng = np.random.default_rng([seed, 40])
    pose = np.append(rng.uniform(-0.5, 0.5, 2), [rng.uniform(0.8, 2.0), *rng.uniform(-0.6, 0.6, 3)])
    return *draw_platform(rng), pose


def compare(found, ends, theirs):
    """Say how our poses, and the ends of our forty paths (40, 8), differ from PHCpack's points."""
    turns = np.array([orientation(*pose[3:]).reshape(3, 3) for pose in found.poses])
    poses = compute_study_points(turns.reshape(-1, 3, 3), found.poses[:, :3] / 1000.0)
    real = theirs[measure_angles(theirs, theirs.conj()).diagonal() < SAME]
    apart = [match_points(poses, real), match_points(ends, theirs)]
    if len(theirs) == ALL and max(apart) < SAME:
        return f"agrees within {apart[0]:.1e}, with the complex ones {apart[1]:.1e}"
    return f"DIFFERS: it has {len(theirs)}, {len(real)} real, {apart[0]:.1e} and {apart[1]:.1e} from ours"


def sweep(folder, seed, by_phcpack):
    """What is to be told of one platform."""
    feet, corners, pose = draw_posed(seed)
    machine = platform(folder, feet, corners, home=pose)
    lengths = machine.inverse(machine.home)
    found = machine.assemblies(lengths)
    total = len(found) + found.complex_count
    open_by = np.abs(machine.inverse(found.poses) - lengths).max(initial=0.0)
    near = np.abs(found.poses - machine.home).max(1).min(initial=np.inf)
    proved = np.isfinite(found.radii).all()
    good = total == ALL and not found.lost_count and proved and open_by < 1e-9 * lengths.max() and near < 1e-4
    ends = f"{found.infinite_count} at infinity, {found.lost_count} lost"
    words = f"{'good' if good else 'BAD'} {len(found)} real {found.complex_count} complex, {ends}, "
    words += f"open by {open_by:.1e} mm, {'proved' if proved else 'not proved'}, home off {near:.1e}"
    if by_phcpack:
        theirs, starts = track_by_phcpack(folder, describe_closures(feet, corners, lengths / 1000.0))
        ends = track_once_more(make_systems([seed])[0])
        words += f"; PHCpack {compare(found, ends.points[0], theirs)} after {starts}"
    return words


def make_system(feet, corners, place, turn):
    """A platform's quadrics (6, 8, 8) at the lengths of a pose, m."""
    lengths = np.linalg.norm(place + corners @ turn.T - feet, axis=1)
    quadrics = []
    for foot, corner, length in zip(feet, corners, lengths, strict=True):
        numbers = [0.5, *-foot, 0.5 * (foot @ foot - length**2)]
        quadric = np.tensordot(numbers, make_closure_quadrics(corner), 1)
        quadrics.append(quadric / np.linalg.norm(quadric))
    return np.array(quadrics)


def track_platforms(systems, phase, tolerance):
    """The ends of all forty paths of each system."""
    member = find_generic_member(FREE)
    first, last = align_members(member.system, systems, 1)
    first[:, 1:] *= phase
    return track_members(first, last, member.roots, tolerance)


def make_systems(seeds):
    """The systems of the platforms that seeds draw, and the points of the poses that they draw."""
    poses, systems = [], []
    for seed in seeds:
        feet, corners, pose = draw_posed(seed)
        turn = orientation(*pose[3:]).reshape(3, 3)
        systems.append(make_system(feet, corners, pose[:3], turn))
        poses.append(compute_study_points(turn[None], pose[None, :3])[0])
    return make_family(FREE).make_member(np.array(systems, complex)), poses


def track_once_more(systems):
    """The ends of all paths another way, in shorter steps, as where a path was lost or met another."""
    return track_platforms(systems, np.exp(1j), STRICT)


def sweep_systems(seeds):
    """What is to be told of each platform: all ends apart, on its quadrics, and the pose drawn among them."""
    systems, poses = make_systems(seeds)
    ends = track_platforms(systems, 1.0, 1e-4)
    lines = []
    for row, (pose, system) in enumerate(zip(poses, systems, strict=True)):
        points, whole = ends.points[row], (ends.reached[row] == 1.0).all() and not find_meetings(ends)[row].any()
        words = "tracked once"
        if not whole:
            again = track_once_more(system[None])
            points, whole = again.points[0], (again.reached == 1.0).all() and not find_meetings(again).any()
            words = "tracked twice"
        cosines = np.abs(points.conj() @ points.T) - np.eye(ALL)
        apart = np.arccos(np.minimum(cosines.max(), 1.0))
        off = np.abs(np.einsum("ki,rij,kj->kr", points, system, points)).max()
        near = 1.0 - np.abs(points.conj() @ pose).max() / np.linalg.norm(pose)
        good = whole and apart > 1e-7 and off < 1e-11 and near < 1e-9
        lines.append(
            f"{'good' if good else 'BAD'} {words}, least angle {apart:.1e}, open by {off:.1e}, home off {near:.1e}"
        )
    return lines


def main():
    first, last, log = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    if "systems" in sys.argv:
        for begin in range(first, last, BLOCK):
            seeds = range(begin, min(begin + BLOCK, last))
            with log.open("a") as file:
                file.writelines(f"{seed} {words}\n" for seed, words in zip(seeds, sweep_systems(seeds), strict=True))
        return
    done = {line.split()[0] for line in log.read_text().splitlines()} if log.exists() else set()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, last):
            if str(seed) not in done:
                try:
                    words = sweep(Path(folder), seed, "phc" in sys.argv)
                except Exception as error:  # it is told, and the others are run
                    words = f"BAD {type(error).__name__}: {error}"
                with log.open("a") as file:
                    file.write(f"{seed} {words}\n")


main()
