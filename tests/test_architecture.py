"""The layers: the core knows no files, plots or controllers, and what is heavy is imported inside the command."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import parakin

ROOT = Path(parakin.__file__).parent
CORE = [*(ROOT / "model").rglob("*.py"), *(ROOT / "kernels").rglob("*.py"), *(ROOT / "kinematics").rglob("*.py")]
CORE += [*(ROOT / "analysis").rglob("*.py"), ROOT / "machine.py", ROOT / "algebra.py"]
LAYERS = {  # none looks up
    "kernels": {"model", "kinematics", "machine", "analysis"},
    "model": {"kinematics", "machine", "analysis"},
    "kinematics": {"analysis"},
}
RIM = {"description", "quantities", "toolpath", "export", "commands", "cli"}
FORBIDDEN = {"pathlib", "json", "io", "tempfile", "shutil", "plotly", "matplotlib", "pyarrow", "rich", "cyclopts"}
FORBIDDEN |= {"pydantic", "ruamel", "http", "socket", "subprocess"}


def imports(path: Path) -> set[str]:
    """Names of all modules a file imports; of parakin's own the part behind ``parakin``."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                base = path.parent
                for _ in range(node.level - 1):
                    base = base.parent
                parts = [*base.relative_to(ROOT).parts, *(node.module or "").split(".")]
                found |= {next((part for part in parts if part), alias.name) for alias in node.names}
            elif node.module:
                found.add(node.module.split(".")[0])
    return found


@pytest.mark.parametrize("path", CORE, ids=lambda p: str(p.relative_to(ROOT)))
def test_the_core_knows_nothing_of_the_rim(path):
    assert not imports(path) & (RIM | FORBIDDEN)


@pytest.mark.parametrize("path", CORE, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_layer_looks_up(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for_types = [n for n in ast.walk(tree) if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.unparse(n.test)]
    if not for_types:
        assert not imports(path) & LAYERS.get(path.relative_to(ROOT).parts[0], set())


PATHS = sorted((ROOT / "toolpath").rglob("*.py"))


@pytest.mark.parametrize("path", PATHS, ids=lambda p: str(p.relative_to(ROOT)))
def test_tool_paths_know_no_exports_and_no_commands(path):
    assert not imports(path) & {"export", "commands", "cli", "plotly", "matplotlib", "rich", "cyclopts"}


def test_there_is_a_core_to_look_at():
    assert len(CORE) > 20
    assert "algebra" in imports(ROOT / "kernels" / "tape.py")


@pytest.mark.parametrize("module", ["parakin", "parakin.cli"])
def test_starting_imports_nothing_heavy(module):
    code = f"import sys, {module}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert module in loaded
    heavy = {"numpy", "numba", "pydantic", "plotly", "matplotlib", "pyarrow", "scipy", "ruamel.yaml"}
    heavy |= {"trimesh", "skimage"}
    assert not heavy & set(loaded)
