"""All assembly modes of one joint vector: closed forms where there are some, else homotopy continuation."""

from .assembly_solution import Assemblies, find_assemblies

__all__ = ["Assemblies", "find_assemblies"]
