"""The floors: every import leads down, none in a circle, and what is heavy is imported inside the command."""

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import parakin

ROOT = Path(parakin.__file__).parent

# From the ground up. What stands on one line knows nothing of each other.
FLOORS = [
    ["errors", "arrays"],
    ["units", "algebra"],
    ["kernels"],
    ["model"],
    ["kinematics", "description"],
    ["machine"],
    ["workspaces"],
    ["performance"],
    ["toolpath.path"],
    ["toolpath.reading"],
    ["toolpath.posting"],
    ["toolpath.timing", "toolpath.checking", "toolpath.placing"],
    ["toolpath.linearise"],
    ["toolpath.job"],
    ["controllers", "export"],
    ["commands"],
    ["__init__", "cli"],
]
HEIGHT = {room: height for height, floor in enumerate(FLOORS) for room in floor}
CORE = ["arrays", "algebra", "kernels", "model", "kinematics", "machine", "workspaces", "performance"]
RIM = {"pathlib", "json", "io", "tempfile", "shutil", "plotly", "matplotlib", "pyarrow", "rich", "cyclopts"}
RIM |= {"pydantic", "ruamel", "http", "socket", "subprocess"}
NO_PATH_NEEDS = {"plotly", "matplotlib", "rich", "cyclopts"}


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts)


MODULES = {module_of(path): path for path in sorted(ROOT.rglob("*.py"))}


def imports(module: str) -> tuple[set[str], set[str]]:
    """What a file imports anywhere in it, for types only too: modules of parakin's own, and names of others."""
    path, own, others = MODULES[module], set(), set()
    package = [] if module == "__init__" else module.split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            others |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            others.add((node.module or "").split(".")[0])
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
            for alias in node.names:
                full = ".".join([*base, alias.name])
                own.add(full if full in MODULES else ".".join(base) or "__init__")
    return own, others


def room_of(module: str) -> str | None:
    """The room of FLOORS that a module stands in."""
    rooms = [room for room in HEIGHT if module == room or module.startswith(room + ".")]
    return max(rooms, key=len, default=None)


@pytest.mark.parametrize("module", MODULES)
def test_every_module_has_a_room(module):
    assert room_of(module) is not None or module == "toolpath" or module.startswith("machines")


@pytest.mark.parametrize("module", MODULES)
def test_no_import_leads_up(module):
    here = room_of(module)
    for other in imports(module)[0] - {"__init__", "toolpath"}:
        there = room_of(other)
        assert there == here or HEIGHT[there] < HEIGHT[here], f"{module} imports {other}"


def test_no_imports_lead_in_a_circle():
    graph = {module: imports(module)[0] - {module, "__init__"} for module in MODULES}
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(" -> ".join(reversed(error.args[1])))


@pytest.mark.parametrize("module", [m for m in MODULES if room_of(m) in CORE])
def test_the_core_knows_no_files_plots_or_controllers(module):
    assert not imports(module)[1] & RIM


@pytest.mark.parametrize("module", [m for m in MODULES if m.startswith("toolpath")])
def test_tool_paths_know_no_plots_and_no_terminal(module):
    assert not imports(module)[1] & NO_PATH_NEEDS


def test_the_imports_are_seen():
    assert len(MODULES) > 150
    assert "algebra" in imports("kernels.tape")[0]
    assert "kernels.batch" in imports("machine")[0]
    assert "numpy" in imports("machine")[1]
    assert {"machine", "toolpath.job"} <= imports("__init__")[0]  # TYPE_CHECKING ones count


@pytest.mark.parametrize("module", ["parakin", "parakin.cli"])
def test_starting_imports_nothing_heavy(module):
    code = f"import sys, {module}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert module in loaded
    heavy = {"numpy", "numba", "pydantic", "plotly", "matplotlib", "pyarrow", "scipy", "ruamel.yaml"}
    heavy |= {"trimesh", "skimage"}
    assert not heavy & set(loaded)
