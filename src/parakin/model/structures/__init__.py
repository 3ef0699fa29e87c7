"""The ways in which a platform, a head and a table make a machine."""

from __future__ import annotations

from ...errors import DescriptionError
from ..elements import ROTATIONS, TRANSLATIONS
from ..spec import Spec
from .base import DirectionColumns, PlatformPlacement, Structure
from .carried import Carried
from .central_leg import CentralLeg
from .constraint_rates import list_rods, locate_passive_rods, locate_rod
from .five_axis import compute_axis_angles, compute_tool_axis
from .five_axis_platform import FiveAxisPlatform, check_rings
from .free import Free
from .guided import Guided
from .guided_wrist import WristOnGuidedPlatform
from .led_platform import LedPlatform
from .ordered_motion import OrderedMotion, has_pose_order
from .parasitic import check_parasitic_words
from .sliding_table import SlidingTable

__all__ = [
    "Carried",
    "CentralLeg",
    "DirectionColumns",
    "FiveAxisPlatform",
    "Free",
    "Guided",
    "LedPlatform",
    "OrderedMotion",
    "PlatformPlacement",
    "SlidingTable",
    "Structure",
    "WristOnGuidedPlatform",
    "compute_axis_angles",
    "compute_tool_axis",
    "list_rods",
    "locate_passive_rods",
    "locate_rod",
    "make_structure",
]


def make_structure(spec: Spec) -> Structure:
    """Find the structure of a machine; a :class:`DescriptionError` says why there is none."""
    twice = [bound.name for bound in spec.limits.passive if spec.motion.count(bound.name) > 1]
    if twice:
        raise DescriptionError("limits", f"passive {twice[0]} stands twice in the motion, so it is not one coordinate")
    check_rings(spec)
    if spec.constraints or spec.parasitic:
        return _make_guided_structure(spec)
    drives = [(step.axis, step.drive.name) for step in (*spec.head, *spec.table) if step.drive is not None]
    for axis, name in drives:
        if axis in TRANSLATIONS:
            raise DescriptionError("head", f"joint {name}: the drives of head and table turn; {axis} can't be one")
    driven = len(drives)
    if spec.motion[0] in ROTATIONS and set(spec.motion) & set(TRANSLATIONS) == {"tz"}:
        return CentralLeg(spec) if driven else LedPlatform(spec)
    if driven == 0:
        if spec.table:
            raise DescriptionError("table", "a table without a driven turn does nothing; leave it out")
        if len(spec.motion) == 5:
            return FiveAxisPlatform(spec)
        return Free(spec) if has_pose_order(spec.motion) else OrderedMotion(spec)
    if set(spec.motion) != set(TRANSLATIONS) or len(spec.motion) != 3:
        raise DescriptionError(
            "motion",
            f"{' '.join(spec.motion)}: with a driven head or table it is tx ty tz, or a central leg (rx ry tz)",
        )
    return Carried(spec)


def _make_guided_structure(spec: Spec) -> Structure:
    """Find the structure of a machine whose constraints leave parasitic motions."""
    check_parasitic_words(spec.motion, spec.parasitic, len(spec.constraints))
    parasitic = [bound.name for bound in spec.limits.passive if bound.name in spec.parasitic]
    if parasitic:
        raise DescriptionError("limits", f"passive {parasitic[0]} is parasitic, and follows from the other coordinates")
    if any(step.drive is not None for step in spec.head):
        return WristOnGuidedPlatform(spec)
    return SlidingTable(spec) if spec.table else Guided(spec)
