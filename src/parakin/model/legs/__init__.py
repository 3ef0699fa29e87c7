"""The leg kinds. Every module of this folder that defines a :class:`Leg` is one, without a list of them."""

from importlib import import_module
from pkgutil import iter_modules

from .base import Inverse, Leg, Link, Reach

__all__ = ["KINDS", "Inverse", "Leg", "Link", "Reach"]


def _collect_kinds() -> dict[str, type[Leg]]:
    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    kinds = _list_subclasses(Leg)  # type: ignore[type-abstract]
    return {cls.kind: cls for cls in sorted(kinds, key=lambda cls: cls.kind)}


def _list_subclasses(base: type[Leg]) -> list[type[Leg]]:
    return [cls for own in base.__subclasses__() for cls in (own, *_list_subclasses(own))]


KINDS: dict[str, type[Leg]] = _collect_kinds()
