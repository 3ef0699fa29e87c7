"""Machine files: YAML that becomes a :class:`~parakin.model.spec.Spec`."""

from .machine_file import find_key_line, find_machine_file, list_shipped_machines, read_machine, write_sizes

__all__ = ["find_key_line", "find_machine_file", "list_shipped_machines", "read_machine", "write_sizes"]
