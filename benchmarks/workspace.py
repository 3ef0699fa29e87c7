"""Workspaces: the certified bracket and the dense grid, against grids in plain NumPy as a user would write them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from measure import best, table

import parakin as pk
from parakin.kernels.batch import count_cores
from parakin.workspaces.sampled.sampling import BrokenLimitFinder, find_bounding_box

OWN_ERROR = 0.05  # of the NumPy grid: half the volume of the cells that its boundary cuts, relative to its volume
UPRIGHT = {"B": 0.0, "C": 0.0}
LEAN = np.deg2rad(15.0)
TOTAL = dict.fromkeys("ABC", (-LEAN, LEAN))

Axes = tuple[np.ndarray, ...]


def tricept(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Where the Tricept stands upright within its limits: FME Transactions 41, (19) to (41), at B = C = 0."""
    big, small, l1, l2, root = 350.0, 100.0, 300.0, 150.0, np.sqrt(3.0)
    w = z + l2
    side = np.sqrt(y * y + w * w)
    length = np.sqrt(x * x + side * side)
    p = length - l1
    st, ct, sp, cp = -x / length, side / length, y / side, -w / side
    common, half = p * p + (small * small + big * big), small * big / 2.0
    allowed = np.ones(np.broadcast_shapes(x.shape, y.shape, z.shape), bool)
    for square in (
        common - 2.0 * p * big * ct * sp - 2.0 * small * big * cp,
        common + p * big * (ct * sp - root * st) + half * (-3.0 * ct - root * st * sp - cp),
        common + p * big * (ct * sp + root * st) + half * (-3.0 * ct + root * st * sp - cp),
    ):
        allowed &= (square >= 934.0**2) & (square <= 1520.0**2)
    kx, ky, kz = -st * cp, sp, ct * cp  # the tool's axis in the platform
    theta1, theta2 = np.arctan2(-ky, -kx), np.arctan2(np.sqrt(kx * kx + ky * ky), kz)
    allowed &= (np.abs(theta1) <= np.deg2rad(360.0)) & (theta2 <= np.deg2rad(120.0))
    allowed &= (np.abs(np.arctan2(sp, cp)) <= np.deg2rad(60.0)) & (np.abs(np.arctan2(st, ct)) <= np.deg2rad(60.0))
    return allowed


def on_grid(coordinates: Axes) -> np.ndarray:
    """A plane at a time, so that it stays in the cache."""
    x, y, z = coordinates
    return np.stack([tricept(np.full((1, 1), value), y[:, None], z[None, :]) for value in x])


def lambda6(x: np.ndarray, y: np.ndarray, z: np.ndarray, turn: tuple[float, ...]) -> np.ndarray:
    """Where the Lambda machine stands within its limits: IJEEC 6, (6) and on, for one orientation."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(turn), np.cos(turn)
    rotation = np.array(
        [
            [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
            [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
            [-sb, cb * sa, cb * ca],
        ]
    )
    allowed = np.ones(len(x), bool)
    for angle in np.radians([180.0, 60.0, -60.0]):
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        dx, dy, dz = 230.0 * rotation @ way - 900.0 * way
        square = 1200.0**2 - (x + dx) ** 2 - (y + dy) ** 2
        rise = np.sqrt(square)
        reach = 0.75 * rise
        long = z + dz - rise
        gap = reach + np.sqrt(reach * reach - (900.0**2 - 800.0**2))
        allowed &= (long >= 0.0) & (long <= 2200.0) & (gap >= 500.0) & (gap <= 1600.0) & (long + gap <= 2200.0)
    return allowed


def in_every_turn(coordinates: Axes, turns: list[tuple[float, ...]], drop: bool) -> np.ndarray:
    """All places in all turns; with ``drop`` only those that no turn has ruled out yet."""
    places = [part.reshape(-1) for part in np.meshgrid(*coordinates, indexing="ij")]
    allowed = np.ones(len(places[0]), bool)
    for turn in turns:
        which = np.flatnonzero(allowed) if drop else slice(None)
        allowed[which] &= lambda6(*[part[which] for part in places], turn)
    return allowed.reshape([len(part) for part in coordinates])


def own_error(mask: np.ndarray) -> float:
    """Half the volume of the cells between the grid's points that its boundary cuts, relative to its volume."""
    ends = (slice(None, -1), slice(1, None))
    corners = [mask[i, j, k] for i, j, k in product(ends, repeat=3)]
    within, touched = np.logical_and.reduce(corners), np.logical_or.reduce(corners)
    cut = np.count_nonzero(touched) - np.count_nonzero(within)
    return 0.5 * cut / (np.count_nonzero(within) + 0.5 * cut)


def by_rule(grid: Callable[[float], pk.GridWorkspace]) -> pk.GridWorkspace:
    """The grid whose own error is as wanted: that shrinks with the step."""
    step = 40.0
    for _ in range(3):
        found = grid(step)
        step *= OWN_ERROR / own_error(found.mask)
    return found


def main() -> str:
    machine = pk.load("tricept")
    upright = pk.region(machine, UPRIGHT, components="all")  # NumPy's grid does not ask for the side of det A

    def certified(components: str = "all", **how: float) -> Callable[[], object]:
        return lambda: pk.workspace(pk.region(machine, at=UPRIGHT, components=components), seconds=None, **how)

    one, third = best(certified(gap=0.01), 5), best(certified(gap=0.003), 3)
    home = best(certified("home", gap=0.01), 5)
    cells = [best(certified(cell=cell), 3) for cell in (40.0, 20.0, 10.0)]
    ruled = by_rule(lambda step: pk.sample_grid(upright, step))
    plain = best(lambda: on_grid(ruled.coordinates), 3)
    differ = int((on_grid(ruled.coordinates) != ruled.mask).sum())
    finder, sided = BrokenLimitFinder(upright), BrokenLimitFinder(pk.region(machine, UPRIGHT))
    codes = finder.find_on_grid(ruled.coordinates)
    copied = codes.copy()
    dense_home = best(lambda: sided.find_on_grid(ruled.coordinates), 5)
    dense, copy = best(lambda: finder.find_on_grid(ruled.coordinates), 5), best(lambda: np.copyto(copied, codes), 5)
    title = f"Tricept upright, {count_cores()} cores (NumPy: one); the NumPy grid of {OWN_ERROR:.0%} has steps of "
    title += f"{ruled.step:.1f} mm, {ruled.broken.size:,} places, {differ} of them otherwise than the mask"
    rows = [
        ["certified, 1 %", f"{one:.3f}", f"{one / plain:.2f}", "of the NumPy grid of 5 %", "< 1"],
        ["certified, 1 %, on home's side of det A", f"{home:.3f}", f"{home / one:.2f}", "of all sides", ""],
        ["NumPy grid of 5 %", f"{plain:.3f}", "1.00", "", ""],
        ["certified, 0.3 %", f"{third:.3f}", f"{third / one:.2f}", "of 1 %", ""],
        ["certified, cells of 40 mm", f"{cells[0]:.3f}", "", "", ""],
        ["certified, cells of 20 mm", f"{cells[1]:.3f}", f"{cells[1] / cells[0]:.2f}", "of 40 mm", "≤ 4.5"],
        ["certified, cells of 10 mm", f"{cells[2]:.3f}", f"{cells[2] / cells[1]:.2f}", "of 20 mm", "≤ 4.5"],
        ["mask", f"{dense:.3f}", f"{codes.size / dense / 1e6:.0f}", "million poses a second", "≥ 260"],
        ["mask", "", f"{plain / dense:.0f}", "times as fast as NumPy", ""],
        ["mask", "", f"{dense / copy:.0f}", "times the copy of its bytes", ""],
        ["mask, on home's side of det A", f"{dense_home:.3f}", f"{dense_home / dense:.2f}", "of all sides", ""],
    ]
    return table(title, ["what", "s", "ratio", "to", "bound"], rows) + "\n" + total_orientation()


def total_orientation() -> str:
    """The Lambda machine in every A, B, C within 15°, 5° apart, places 20 mm apart."""
    asked = pk.region(pk.load("lambda6"), every=TOTAL, components="all")
    grid = pk.sample_grid(asked, 20.0)
    turns = [tuple(turn) for turn in BrokenLimitFinder(asked).orientations]
    box = find_bounding_box(asked)
    with np.errstate(invalid="ignore"):
        plain = best(lambda: in_every_turn(grid.coordinates, turns, drop=False), 1)
        dropping = best(lambda: in_every_turn(grid.coordinates, turns, drop=True), 1)
        differ = int((in_every_turn(grid.coordinates, turns, drop=True) != grid.mask).sum())
    own, search = best(lambda: pk.sample_grid(asked, 20.0, box), 5), best(lambda: find_bounding_box(asked), 3)
    rows = [
        ["NumPy, every place in every turn", f"{plain:.3f}", "1.00", ""],
        ["NumPy, places dropped once ruled out", f"{dropping:.3f}", f"{dropping / plain:.3f}", ""],
        ["dense_grid, the same places", f"{own:.3f}", f"{own / plain:.3f}", "≤ 0.1"],
        ["the search for their box, besides", f"{search:.3f}", f"{search / plain:.3f}", ""],
    ]
    title = (
        f"Lambda, total orientation: {grid.broken.size:,} places, {len(turns)} turns, {differ} places told otherwise"
    )
    return table(title, ["what", "s", "ratio", "bound"], rows)


if __name__ == "__main__":
    print(main())
