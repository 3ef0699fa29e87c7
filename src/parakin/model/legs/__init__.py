"""The leg kinds. Every module of this folder that defines a :class:`Leg` is one, without a list of them."""

from importlib import import_module
from pkgutil import iter_modules

from .base import Inverse, Leg, Reach

__all__ = ["KINDS", "Inverse", "Leg", "Reach"]


def _collect_kinds() -> dict[str, type[Leg]]:
    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    return {cls.kind: cls for cls in Leg.__subclasses__()}


KINDS: dict[str, type[Leg]] = _collect_kinds()
