"""Names of :mod:`.number_format` that other rooms still use."""

from .number_format import format_bound as edge

__all__ = ["edge"]
