"""The numbered and named parameters by which a program reads the control's state, as LinuxCNC has them."""

from collections.abc import Callable

from . import codes
from .expressions import Key
from .motion import AXES, GcodeMotion
from .parameters import Parameters
from .work_systems import COUNT

_LOCAL, _SYSTEM, _ORIGINS, _POSITION = 5211, 5220, 5221, 5420
_ROTATION = 9  # offset of a work system's rotation from its first number; each has twenty numbers
_PER_SYSTEM = 20


def add_machine_parameters(parameters: Parameters, motion: GcodeMotion, others: dict[Key, Callable[[], float]]) -> None:
    """Let the parameters read what the motion knows, and ``others``. Offsets are mm, positions in the unit in force."""
    systems = motion.systems
    readers: dict[Key, Callable[[], float]] = {
        _SYSTEM: lambda: float(systems.current),
        "_coord_system": lambda: codes.G_GROUPS["system"][systems.current - 1] * 1.0,
        "_motion_mode": lambda: float(motion.mode if motion.mode is not None else 800),
        "_plane": lambda: float(motion.plane),
        "_metric": lambda: float(motion.scale == 1.0),
        "_imperial": lambda: float(motion.scale != 1.0),
        "_absolute": lambda: float(not motion.incremental),
        "_incremental": lambda: float(motion.incremental),
        "_inverse_time": lambda: float(motion.inverse_time),
        "_units_per_minute": lambda: float(not motion.inverse_time),
        "_units_per_rev": lambda: 0.0,
        "_ijk_absolute_mode": lambda: float(motion.absolute_centres),
        "_feed": lambda: motion.rate,
        "_line": lambda: float(parameters.line),
        "_call_level": lambda: float(parameters.depth),
        "_tool_offset": lambda: float(systems.tool.any()),
    }
    for k, letter in enumerate(AXES):
        scale = (lambda: motion.scale) if k < len("XYZ") else (lambda: 1.0)

        def read_position(k: int = k, scale: Callable[[], float] = scale) -> float:
            return motion.here[k] / scale()

        readers[_POSITION + k] = readers[f"_{letter.lower()}"] = read_position
        readers[_LOCAL + k] = lambda k=k: float(systems.kept[k])  # type: ignore[misc]
        for number in range(1, COUNT + 1):
            readers[_ORIGINS + _PER_SYSTEM * (number - 1) + k] = (
                lambda k=k, number=number: float(systems.origin[number, k])  # type: ignore[misc]
            )
    for number in range(1, COUNT + 1):
        readers[_ORIGINS + _PER_SYSTEM * (number - 1) + _ROTATION] = (
            lambda number=number: float(systems.rotation[number])  # type: ignore[misc]
        )
    parameters.readers |= readers | others
