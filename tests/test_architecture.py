"""The floors: every import leads down, none in a circle, and what is heavy is imported inside the command."""

import ast
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from graphlib import CycleError, TopologicalSorter

import pytest
from sources import MODULES, TREES, for_each, functions, nodes

from parakin.cli import app

# From the ground up. What stands on one line knows nothing of each other.
FLOORS = [
    ["errors", "arrays", "version"],
    ["displays", "units", "algebra", "budget", "annotations"],
    ["arguments"],
    ["kernels"],
    ["model"],
    ["kinematics", "description"],
    ["machine_properties"],
    ["machine"],
    ["families"],
    ["dynamics"],
    ["workspaces.certified"],
    ["workspaces.inscribed", "workspaces.sampled"],
    ["workspaces.connected"],
    ["workspaces"],
    ["performance"],
    ["calibration", "accuracy", "stiffness"],
    ["toolpath.path"],
    ["toolpath.programmed_path"],
    ["toolpath.reading"],
    ["toolpath.posting"],
    ["toolpath.timing.drive_limits"],
    ["toolpath.timing.kernels"],
    ["toolpath.timing", "toolpath.checking", "toolpath.placing"],
    ["toolpath.linearise"],
    ["toolpath.tool_turn", "toolpath.job"],
    ["toolpath.turned_job"],
    ["toolpath"],
    ["comparison", "synthesis"],
    [
        "controllers.controller",
        "controllers.gcode_text",
        "export.files",
        "export.number_format",
        "export.colours",
        "export.rasterising",
    ],
    ["export.shaded_bodies"],
    ["export.space_axes"],
    ["export.figure_file"],
    ["controllers.event_commands", "export.machine", "export.tables", "export.workspace"],
    ["controllers.event_lines", "export.page"],
    ["controllers.joints", "controllers.linuxcnc", "export.report"],
    ["controllers.grbl", "controllers.siemens", "controllers.fanuc", "controllers.beckhoff", "export.json"],
    ["controllers.fluidnc", "controllers.heidenhain"],
    ["controllers", "export"],
    ["notebook"],
    ["__init__"],  # the public names
    ["studio"],
    ["commands"],
    ["cli"],
    ["__main__"],
]
HEIGHT = {room: height for height, floor in enumerate(FLOORS) for room in floor}
CORE = ["arrays", "algebra", "budget", "kernels", "model", "kinematics", "machine_properties", "machine"]
CORE += ["families", "dynamics", "workspaces", "performance", "calibration", "accuracy", "stiffness", "synthesis"]
RIM = {"pathlib", "json", "io", "tempfile", "shutil", "matplotlib", "pyarrow", "rich", "cyclopts"}
RIM |= {"pydantic", "ruamel", "http", "socket", "subprocess"}
NO_PATH_NEEDS = {"matplotlib", "rich", "cyclopts"}


@cache
def imports(module: str) -> tuple[set[str], set[str]]:
    """What a file imports anywhere in it, for types only too: modules of parakin's own, and names of others."""
    path, own, others = MODULES[module], set(), set()
    package = [] if module == "__init__" else module.split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    for node in nodes(module):
        if isinstance(node, ast.Import):
            others |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            assert (node.module or "").split(".")[0] != "parakin", f"{module}: relative imports only"
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


@for_each(MODULES)
def test_every_module_has_a_room(module):
    assert room_of(module) is not None


@for_each(MODULES)
def test_no_import_leads_up(module):
    here = room_of(module)
    for other in imports(module)[0] - {module}:
        there = room_of(other)
        assert there == here or HEIGHT[there] < HEIGHT[here], f"{module} imports {other}"


def test_no_imports_lead_in_a_circle():
    graph = {module: imports(module)[0] - {module} for module in MODULES}
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(" -> ".join(reversed(error.args[1])))


@for_each([m for m in MODULES if m.split(".")[0] in CORE])
def test_the_core_knows_no_files_plots_or_controllers(module):
    assert not imports(module)[1] & RIM


@for_each([m for m in MODULES if m.startswith("toolpath")])
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
    heavy = {"numpy", "numba", "pydantic", "matplotlib", "pyarrow", "scipy", "ruamel.yaml"}
    heavy |= {"trimesh", "skimage"}
    assert not heavy & set(loaded)


def parameters(function: ast.FunctionDef) -> int:
    names = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return len([name for name in names if name.arg not in ("self", "cls")])


ABOVE = [m for m in MODULES if room_of(m) is not None and HEIGHT[room_of(m)] > HEIGHT["machine"]]


@for_each(ABOVE)
def test_nobody_above_the_machine_asks_its_model(module):
    asked = [n.lineno for n in nodes(module) if isinstance(n, ast.Attribute) and n.attr == "model"]
    assert not asked


DESCRIBED = {"family", "title", "source"}  # what a machine's description says in words


@for_each([m for m in ABOVE if m != "export.json.machine"])  # that one writes the description
def test_nobody_above_the_machine_reads_its_description(module):
    words = {id(n.value) for n in nodes(module) if isinstance(n, ast.Attribute) and n.attr in DESCRIBED}
    asked = [n for n in nodes(module) if isinstance(n, ast.Attribute) and n.attr == "spec"]
    assert not [n.lineno for n in asked if id(n) not in words]


@for_each([m for m in MODULES if room_of(m) != "model"])
def test_structures_are_asked_for_behaviour_not_for_their_type(module):
    calls = [n for n in nodes(module) if isinstance(n, ast.Call) and ast.unparse(n.func) == "isinstance"]
    assert not [call.lineno for call in calls if "structure" in ast.unparse(call.args[0])]


@for_each([m for m in MODULES if room_of(m) != "commands"])
def test_no_function_takes_more_than_eight_parameters(module):
    assert not [f.name for f in functions(module) if parameters(f) > 8]


TAPES = {"kernels.enclosures.interpret"}


@for_each(MODULES)
def test_no_function_is_longer_than_seventy_lines(module):
    long = [f.name for f in functions(module) if f.end_lineno - f.lineno >= 70]
    assert not [name for name in long if f"{module}.{name}" not in TAPES]


def type_names(module: str) -> list[str]:
    """Classes, and names that a file gives to types: those that begin with a capital but are no constants."""
    names = []
    for node in nodes(module):
        if isinstance(node, ast.ClassDef):
            names.append(node.name)
    for node in TREES[module].body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names += [t.id for t in targets if isinstance(t, ast.Name) and t.id[:1].isupper() and not t.id.isupper()]
    return names


def test_the_name_of_a_class_or_type_occurs_once():
    owners: dict[str, list[str]] = {}
    for module in MODULES:
        for name in type_names(module):
            owners.setdefault(name, []).append(module)
    assert {"Array", "AxisRange", "Machine", "RegionKind"} <= set(owners)
    assert not {name: modules for name, modules in owners.items() if len(modules) > 1}


def test_a_riddling_file_name_stands_once():
    names = [path.stem for path in MODULES.values()]
    assert not [name for name in ("parts", "cuts", "words", "motions", "blocks") if names.count(name) > 1]


COLUMNS = {"kinematics.wrist.pose_angles", "model.structures.five_axis"}  # who may know where B and C stand in a pose
COLUMNS |= {"kinematics.rotations"}  # A, B and C of a rotation
COLUMNS |= {"controllers.joints.letters"}  # the letters that a program gives to turning joints
COLUMNS |= {"toolpath.linearise.pole_passes"}  # A of the turns that a program gives


def pole_columns(tree_nodes: Iterable[ast.AST]) -> list[int]:
    """Find the lines that take B or C of a pose by number or by letter."""
    letters, lines = {"'A'", "'B'", "'C'"}, []
    for node in tree_nodes:
        names: set[str] = set()
        if isinstance(node, ast.Constant) and node.value in ("ABC", "AB", "BC"):
            lines.append(node.lineno)
        if isinstance(node, ast.Subscript):
            many = isinstance(node.slice, ast.Tuple) and bool(node.slice.elts)
            index = node.slice.elts[-1] if many else node.slice
            column = index.lower if isinstance(index, ast.Slice) else index
            names = {"" if column is None else ast.unparse(column)}
            of_pose = any(word in ast.unparse(node.value) for word in ("pose", "home"))
            if of_pose and names & ({"3", "4", "5", "-2", "-1"} if many else {"3", "4", "5", "-2"}):
                lines.append(node.lineno)
            of_home, of_turns = (word in ast.unparse(node.value) for word in ("home", "turns"))
            if (of_home and names == {"-1"}) or (of_turns and many and names & {"0", "1", "2"}):
                lines.append(node.lineno)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(".index"):
            names = {ast.unparse(node.args[0])}
        elif isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            sides += [element for side in sides if isinstance(side, ast.Tuple) for element in side.elts]
            names = set(map(ast.unparse, sides))
        if names & letters:
            lines.append(node.lineno)
    return lines


@for_each([m for m in MODULES if m not in COLUMNS and room_of(m) != "toolpath.reading"])
def test_the_columns_of_b_and_c_are_the_wrists_matter(module):
    assert not pole_columns(nodes(module))


POLE_LINES = ["poses[:, 4]", "machine.axes.index('C')", "home[3:]", "letter == 'B'", "rates['C']", "machine.home[-1]"]
POLE_LINES += ["letter in 'ABC'", "turns[:, 2]", "'ABC'.index(x)", "axis in ('B', 'C')", "set(axes) & set('ABC')"]


@pytest.mark.parametrize("line", POLE_LINES)
def test_columns_of_b_and_c_are_seen(line):
    others = "poses[:, direction.c]; home[:3]; joints[:, 4]; code[i, 4]"
    seen, unseen = (pole_columns(ast.walk(ast.parse(text))) for text in (line, others))
    assert set(seen) == {1}
    assert not unseen


WORDS = """
accept accumulate act add advance align analyse allocate allow announce answer append apply approach arrange ask assign
average begin bind bisect blend bore bound box bracket bring build call
calibrate cancel centre certify change check choose clamp clear climb clip clone close coincide collect combine compare
compile complete compose compute concatenate confirm continue convert copy correct count cross cut
decide decode decompose delay define derive describe design detect differentiate discard divide draw drill drop
ease embed enclose encode end enter equip erase estimate evaluate exclude execute exit expand expect explain explore
extend
extract factor fail fetch fill filter find finish fit fix flag flatten flip fold follow forbid format free freeze
gather get give go grade group grow guess
halve hash
identify ignore import insert integrate interpolate interpret intersect invert is isolate iterate
join judge
keep
label lay lead leave let limit linearise list load locate lock lower
make map march mark match maximise measure meet merge minimise move multiply
name narrow normalise note number
open order
pace paint pack parse peel pick place plan point polish pose post predict prepare print project prove put
quote
raise rank rate read rebuild recognise record redirect reduce refine refuse register reject relate release remove rename
render renumber reorder repeat replace report repost require reserve reset resize resolve restore restrict retract retry
return reuse reverse rewind rotate round route run
sample save say scale score search select separate serve set settle shade share shift shorten show shrink skip smooth
snap simulate slow solve sort space split spread square stack stage stamp start stop store stretch strip subtract
suggest sum summarise swap sweep switch
tabulate take tally tell test thin tighten tilt trace track transform translate transpose trap trim turn
undo unwind update use
validate verify
wait walk warn warp weigh widen wrap write
yield
"""
VERBS = set(WORDS.split())
# Questions with yes or no for an answer begin with a verb in the third person.
QUESTIONS = {"begins", "bounds", "changes", "crosses", "ends", "has", "is", "spares", "spells", "turns"}
# Names that a mathematician, or Numba, knows.
MATHEMATICS = {"absolute", "atan2", "copysign", "cross", "derivative", "dot", "magnitude", "maximum", "minimum", "norm"}
MATHEMATICS |= {"njit", "product", "sincos", "sqrt", "sub"}
# What people type: a command has its function's name, and so do a few words of `pk`.
COMMANDS = {name for name in app if not name.startswith("-")}
TYPED = COMMANDS | {"main", "to_display", "workpiece"}


@for_each(MODULES)
def test_a_function_is_named_by_a_verb(module):
    for node in TREES[module].body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("__"):
            name = node.name.removeprefix("_")
            known = name in MATHEMATICS or name in TYPED or name.split("_")[0] in VERBS | QUESTIONS
            assert known, f"{node.name}: verb and object expected (VERBS lists the verbs)"


def is_property(function: ast.FunctionDef) -> bool:
    return any("property" in ast.unparse(decorator) for decorator in function.decorator_list)


@for_each(MODULES)
def test_a_function_is_described_by_a_verb(module):
    for function in functions(module):
        text = ast.get_docstring(function)
        if text and not is_property(function) and not (room_of(module) == "commands" and function.name in COMMANDS):
            first = text.split()[0].strip(".,:")
            assert first[0].isupper() and first.lower() in VERBS, f"{function.name}: {first} (VERBS lists the verbs)"


def bodies(module: str) -> list[tuple[str, str]]:
    """What functions of two statements or more do, docstrings apart, with each one's name."""
    made = []
    for function in functions(module):
        steps = function.body[1:] if ast.get_docstring(function) is not None else function.body
        if len(steps) > 1 and function.name != "__init__":
            made.append(("\n".join(map(ast.unparse, steps)), f"{module}.{function.name}"))
    return made


def test_no_two_functions_have_one_body():
    owners: dict[str, list[str]] = {}
    for module in MODULES:
        for body, name in bodies(module):
            owners.setdefault(body, []).append(name)
    assert len(owners) > 500
    assert not [names for names in owners.values() if len(names) > 1]


THRESHOLDS = {"EXACT", "PRINTED", "PROVED", "ASIDE", "LEEWAY", "SAME_MODE", "NEAR_MODE", "SWING", "FLIP", "DISTINCT"}
THRESHOLDS |= {"VICINITY", "TRAVEL", "REPORTED", "TILTED", "NEAR_START", "NEAR_TURN", "NEAR_HOLD", "FAR_TILT"}
THRESHOLDS |= {"WAVER", "LEAST_LEAN", "OWN", "OTHER", "EITHER"}


@for_each([m for m in MODULES if not m.startswith("kinematics.wrist.pole_")])
def test_pole_thresholds_and_modes_are_the_wrists_matter(module):
    """No other file has a threshold or a mode of the same name, or turns one into sin²."""
    for node in nodes(module):
        if isinstance(node, ast.Assign):
            assert not {ast.unparse(target).lstrip("_") for target in node.targets} & THRESHOLDS
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("np.sin", "sin", "math.sin"):
            assert ast.unparse(node.args[0]) not in THRESHOLDS


# Numbers about poles that are no angles off a pole: fractions of the tolerance or of a way, ratios, steps, times.
FRACTIONS = {
    "controllers.linuxcnc.approach._LEADS",
    "kinematics.travel._HOP",
    "toolpath.posting.working_mode.HELD",
    "toolpath.timing.pole_pace.LEAST",
    "toolpath.linearise.crossed_poles._TOGETHER",
    "toolpath.linearise.pole_holds._OFF_POLE",
    "toolpath.linearise.pole_holds._ARC",
    "toolpath.linearise.pole_holds._CLOSE",
    "toolpath.linearise.pole_holds._OPPOSITE",
    "toolpath.linearise.pole_passes._LARGE_MISS",
    "toolpath.linearise.pole_routing._BENT",
    "toolpath.linearise.pole_routing._SNAPPED",
    "toolpath.linearise.pole_routing._STRAIGHT",
    "toolpath.linearise.pole_steps.FARTHEST_STEP",
    "toolpath.linearise.pole_steps._POLE_TURN",
}


def pole_constants(source: str, tree: ast.Module) -> set[str]:
    """Find the module's constants whose comment, on their line, speaks of a pole."""
    lines, names = source.splitlines(), set()
    for node in tree.body:
        if isinstance(node, ast.Assign) and "pole" in lines[node.end_lineno - 1].partition("#")[2]:
            names |= {ast.unparse(target) for target in node.targets}
    return names


def constants_about_poles(module: str) -> set[str]:
    return pole_constants(MODULES[module].read_text(encoding="utf-8"), TREES[module])


def test_constants_about_poles_are_seen():
    source = "_LEAST = 0.02  # rad off the pole\nOTHER = 1.0  # mm"
    assert pole_constants(source, ast.parse(source)) == {"_LEAST"}
    constants = {f"{m}.{name}" for m in MODULES for name in constants_about_poles(m)}
    assert constants >= FRACTIONS


@for_each([m for m in MODULES if not m.startswith("kinematics.wrist.pole_")])
def test_numbers_about_poles_are_the_wrists_matter(module):
    constants = constants_about_poles(module)
    assert not {f"{module}.{name}" for name in constants} - FRACTIONS
