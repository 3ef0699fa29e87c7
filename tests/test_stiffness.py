"""Stiffness against finite elements, published figures, and direct problems of machines that give way."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from frame_elements import Frame
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.dynamics.inverse_dynamics import Dynamics, Motion
from parakin.dynamics.masses import compute_masses
from parakin.dynamics.multibody import build_multibody

E = 210e3  # N/mm²
TUBE = {"diameter": "40 mm", "wall": "5 mm"}
AREA = np.pi * (40.0**2 - 30.0**2) / 4.0
SECOND = np.pi * (40.0**4 - 30.0**4) / 64.0
DRIVE = 1e5  # N/mm


def draw_poses(machine, count=3):
    rng = np.random.default_rng(4)
    ways = rng.uniform(-1.0, 1.0, (count, len(machine.axes))) * np.where(np.array(machine.axis_units) == "mm", 40, 0.15)
    poses = machine.home + ways
    assert (machine.check(poses) == 0).all()
    return poses


def place_legs(machine, pose):
    """Each leg's struts, base frame and machine frame alike for these machines, and its platform point."""
    placed = machine.place_platform(pose, machine.mode)
    points = [np.array(point) for point in machine.place_leg_joints(placed)]
    joints = machine.inverse(pose).tolist()
    own = [[joints[machine.joints.index(drive.name)] for drive in leg.drives] for leg in machine.legs]
    struts = [leg.struts(tuple(p), q) for leg, p, q in zip(machine.legs, points, own, strict=True)]
    mount = np.array(machine.structure.mount)
    return [[(mount @ a, mount @ b) for a, b in pairs] for pairs in struts]


def compute_hexapod(machine, pose):
    frame = Frame()
    tip = frame.node(pose[:3])
    ends = []
    for ((foot, end),) in place_legs(machine, pose):
        low, high = frame.node(foot), frame.node(end)
        frame.hold(low, range(6))
        frame.bar(low, high, 1.0 / (1.0 / DRIVE + np.linalg.norm(end - foot) / (E * AREA)))
        ends.append(high)
    frame.body(tip, ends)
    return frame.compliance(tip, range(6))


def compute_orthoglide(machine, pose):
    frame = Frame()
    tip = frame.node(pose)
    frame.hold(tip, [3, 4, 5])
    for leg, ((foot, end),) in zip(machine.legs, place_legs(machine, pose), strict=True):
        slide, high = frame.node(foot), frame.node(end)
        frame.spring(slide, leg.rail, DRIVE)
        for across in np.linalg.svd(np.array([leg.rail]))[2][1:]:
            frame.spring(slide, across, 1e15)
        frame.bar(slide, high, E * AREA / np.linalg.norm(end - foot))
        frame.body(tip, [high])
    return frame.compliance(tip, range(3))


def compute_lambda(machine, pose):
    frame = Frame()
    tip = frame.node(pose[:3])
    mount = np.array(machine.structure.mount)
    for leg, ((long_foot, end), (short_foot, hinge)) in zip(machine.legs, place_legs(machine, pose), strict=True):
        first, second, middle, high = (frame.node(p) for p in (long_foot, short_foot, hinge, end))
        rail = mount @ np.array(leg.rail)
        for slide in (first, second):
            frame.spring(slide, rail, DRIVE)
            for across in np.linalg.svd(np.array([rail]))[2][1:]:
                frame.spring(slide, across, 1e12)
        frame.beam(first, middle, E * AREA, E * SECOND)
        frame.beam(middle, high, E * AREA, E * SECOND)
        frame.spring(first, end - long_foot, 1.0, first=3)  # its turn about itself, which nothing else holds
        frame.bar(second, middle, E * AREA / np.linalg.norm(hinge - short_foot))
        frame.bodies[high] = tip
    return frame.compliance(tip, range(6))


@pytest.mark.parametrize(
    ("name", "compute"), [("hexapod", compute_hexapod), ("orthoglide", compute_orthoglide), ("lambda6", compute_lambda)]
)
def test_finite_elements_give_way_alike(name, compute):
    machine = load_shipped(name)
    poses = draw_poses(machine)
    found = pk.analyse_stiffness(machine, "100 N/um", TUBE, poses)
    for pose, own, matrix in zip(poses, found.compliances, found.matrices, strict=True):
        expected = compute(machine, pose)
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.abs((own - expected) / scale).max() < 1e-5
        assert np.allclose(matrix @ own, np.eye(len(own)), atol=1e-8)


STIFF = {
    "tricept": {"d*": "100 N/um", "theta*": "200 kNm/rad"},
    "rotary_delta": {"*": "5 kNm/rad"},
    "orthoglide5_head": {"rho*": "100 N/um", "*": "50 kNm/rad"},
    "orthoglide5_table": {"rho*": "100 N/um", "*": "50 kNm/rad"},
    "sprint_z3": {"*": "100 N/um"},
    "pentapod": {"*": "100 N/um"},
    "rpr3": {"*": "100 N/um"},
}


@pytest.mark.parametrize("name", STIFF)
def test_the_direct_problem_of_machines_that_give_way(name):
    """Forces on the springs by differences of the direct problem; its answer with all numbers off by what they give."""
    machine = load_shipped(name)
    pose = draw_poses(machine, 1)[0]
    rods = [leg for leg in machine.legs if leg.kind not in ("length", "ring")]
    family = pk.family(machine, ["encoders", *(f"legs.{leg.drives[0].name}.rod" for leg in rods)])
    joints = machine.inverse(pose)
    offsets = {f"joints.{joint}.offset": i for i, joint in enumerate(machine.joints)}
    springs = np.zeros(len(family.names))
    for i, parameter in enumerate(family.parameters):
        if parameter.name in offsets:
            pattern = next(key for key in STIFF[name] if parameter.name.split(".")[1].startswith(key.rstrip("*")))
            number, unit = STIFF[name][pattern].split()
            springs[i] = 1.0 / (float(number) * {"N/um": 1e3, "kNm/rad": 1e6}[unit])
            drive = joints[offsets[parameter.name]]
            fixed = machine.joint_units[offsets[parameter.name]] == "rad" or rods
            springs[i] += 0.0 if fixed else drive / (E * AREA)
        else:
            springs[i] = parameter.value / (E * AREA)
    tip = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"]
    force = np.array([300.0, -200.0, 150.0])[: len(tip)]

    def move(sizes):
        solved = family.forward(joints, sizes, near=pose)
        assert solved.converged
        return solved.poses[tip]

    steps = 1e-4 * np.eye(len(springs))
    ways = np.array([(move(family.nominal + step) - move(family.nominal - step)) / 2e-4 for step in steps])
    expected = move(family.nominal + 1e-2 * springs * (ways @ force)) - move(family.nominal)
    found = pk.analyse_stiffness(machine, STIFF[name], TUBE, pose[None])
    assert np.allclose(1e-2 * found.deflect(force)[0, : len(tip)], expected, rtol=2e-3, atol=2e-7)
    moved = found.deflect(dict(zip("XYZ", force, strict=False)))[0, : len(tip)]
    assert found.along(force)[0] == pytest.approx(force @ force / (force @ moved))
    assert found.least[0] <= found.along(force)[0]


def test_the_published_orthoglide_is_stiff_as_its_amplification_tells():
    """Chablat and Wenger: amplification 1 all ways at the isotropic point; at the end of the cube's diagonal 1/(1 + v)
    across it and 1/(1 - 2v) along it, of which the first is 3."""
    machine = load_shipped("orthoglide")
    isotropic, corner = [0.0, 0.0, 0.0], [-123.336] * 3
    found = pk.analyse_stiffness(machine, "100 N/um", None, [isotropic, corner])
    assert np.allclose(found.matrices[0], DRIVE * np.eye(3), atol=1e-6 * DRIVE)
    assert found.least[1] == pytest.approx(DRIVE / 9.0, rel=1e-4)
    assert found.along([1, -1, 0])[1] == pytest.approx(DRIVE / 9.0, rel=1e-4)
    assert found.along([1, 1, 1])[1] == pytest.approx(DRIVE * (7.0 / 3.0) ** 2, rel=1e-4)


def write_cubic(folder, height, point, edge, centre):
    """Struts along edges of a cube that stands on a corner; the platform and its tool are told from ``point``."""
    across = np.array([[2.0, 0.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]])
    corners = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1]], float) * np.sqrt(3.0) * edge
    corners = corners @ (across / np.linalg.norm(across, axis=0)) - [0.0, 0.0, 1.5 * edge]
    low, high = corners[[0, 2, 2, 4, 4, 0]], corners[[1, 1, 3, 3, 5, 5]]
    ways = (high - low) / (high - low)[:, 2:]
    feet, ends = ([*(low + (z - low[:, 2:]) * ways).T] for z in (-centre, height - centre))
    points = {"foot": np.transpose([feet[0], feet[1], np.zeros(6)])}
    points["platform"] = np.transpose([ends[0], ends[1], np.full(6, -point)])
    told = {
        key: "".join(f"\n    - [{', '.join(f'{x:.9f} mm' for x in row)}]" for row in rows)
        for key, rows in points.items()
    }
    path = folder / f"cubic_{edge}_{point}.yaml"
    path.write_text(
        f"name: cubic\ntitle: Cubic\nsource: Dehaeze.\nsizes: {{tool: 0 mm}}\nmotion: tx ty tz rz ry rx\nlegs:\n"
        f"  kind: length\n  joints: [d1, d2, d3, d4, d5, d6]\n  foot:{told['foot']}\n  platform:{told['platform']}\n"
        f"  range: [10 mm, 900 mm]\nhome: {{X: 0 mm, Y: 0 mm, Z: {height + point} mm, A: 0 deg, B: 0 deg, C: 0 deg}}\n",
        encoding="utf-8",
    )
    return pk.load(path)


@pytest.mark.parametrize(
    ("sizes", "coupling", "tilt", "turn"),
    [
        ((100.0, -50.0, 100.0, 50.0), "0", "0.015", "0.06"),
        ((100.0, 20.0, 100.0, 50.0), "-0.14", "0.025", "0.06"),
        ((80.0, -30.0, 100.0, 50.0), "0", "0.015", "0.06"),
        ((100.0, -50.0, 150.0, 60.0), "0.02", "0.034", "0.14"),
    ],
)
def test_published_tables_of_cubic_platforms(sizes, coupling, tilt, turn, tmp_path):
    """Tables of T. Dehaeze, Cubic configuration for the Stewart platform (stewart-simscape, 2020), two digits, m and N:
    height, the tool's point above the platform, the cube's useful height and its centre above the feet."""
    machine = write_cubic(tmp_path, *sizes)
    matrix = pk.analyse_stiffness(machine, "1 N/mm", None, [machine.home]).matrices[0]
    metres = np.array([1.0] * 3 + [1e-3] * 3)
    found = matrix * np.outer(metres, metres)
    expected = np.diag([2.0] * 3 + [float(tilt)] * 2 + [float(turn)])
    expected[0, 4] = expected[4, 0] = float(coupling)
    expected[1, 3] = expected[3, 1] = -float(coupling)
    digit = 10.0 ** np.floor(np.log10(np.where(expected == 0.0, 1e-6, np.abs(expected))) - 1.0)
    assert (np.abs(found - expected) <= 0.5001 * digit).all()


def test_springs_in_a_row_add_up():
    machine = load_shipped("hexapod")
    drives, both = (pk.analyse_stiffness(machine, "100 N/um", struts, samples=20) for struts in (None, "50 N/um"))
    assert np.allclose(both.compliances, 3.0 * drives.compliances)
    assert np.allclose(both.drive_share, 1.0 / 3.0)
    assert np.allclose(drives.drive_share, 1.0)
    rod = pk.analyse_stiffness(machine, "rigid", {"diameter": "40 mm", "rods": "2"}, drives.poses)
    bar = pk.analyse_stiffness(machine, "rigid", {"diameter": "40 mm", "modulus": "420000 MPa"}, drives.poses)
    assert np.allclose(rod.compliances, bar.compliances)


def test_a_stiffness_for_all_is_taken_by_its_unit():
    machine = load_shipped("tricept")
    named = pk.analyse_stiffness(machine, {"d*": "100 N/um", "theta*": "200 kNm/rad"}, samples=5)
    both = pk.analyse_stiffness(machine, "200 kNm/rad, 100N/um", samples=5)
    assert np.array_equal(named.compliances, both.compliances)
    half = pk.analyse_stiffness(machine, "100N/um, rigid", samples=5)
    assert (half.least > both.least).all()


def test_the_command(tmp_path, capsys):
    path = tmp_path / "map.png"
    words = ["stiffness", "orthoglide", "--drives", "100N/um", "--struts", "diameter=20mm,rods=2", "--samples", "50"]
    assert main([*words, "-o", str(path), "--along", "X"]) == 0
    said = capsys.readouterr().out
    assert "at 50 poses" in said
    assert "count as rigid: a real machine is softer" in said
    assert path.read_bytes().startswith(b"\x89PNG")
    assert main([*words, "--json", "--force", "X=-0.2kN,Z=100N", "-o", str(path)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["schema"] == "parakin.stiffness/1"
    assert answer["deflection"]["force"] == {"X": -200.0, "Y": 0.0, "Z": 100.0}
    assert answer["least"]["0"] <= min(answer["along"][axis]["0"] for axis in "XYZ")


def test_along_a_posted_path(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("part.apt").write_text("UNITS/MM\nFEDRAT/900,MMPM\nGOTO/0,0,0\nGOTO/40,10,0\nFINI\n", encoding="utf-8")
    assert main(["post", "part.apt", "--machine", "orthoglide", "-o", "out", "--workpiece", "0,0,0"]) == 0
    words = ["stiffness", "orthoglide", "--drives", "100N/um", "--csv", "out/part.joints.csv"]
    assert main([*words, "--force", "Y=-50N", "-o", "gives.csv"]) == 0
    table = np.genfromtxt("gives.csv", delimiter=",", names=True, deletechars="")
    assert table["dY_[mm]"][0] == pytest.approx(-50.0 / DRIVE)
    Path("far.csv").write_text("0,0,0\n900,0,0\n", encoding="utf-8")
    capsys.readouterr()
    assert main([*words[:-1], "far.csv"]) == 3
    assert "far.csv:2: out of reach or singular" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "words", "message"),
    [
        (
            "tricept",
            ["--drives", "100N/um"],
            'drives: theta1: "100N/um" is a stiffness, expected an angular stiffness (Nm/rad, kNm/rad)',
        ),
        ("tricept", ["--drives", "d*=100N/um"], "--drives: theta1 has no stiffness; rigid is one"),
        ("tricept", ["--drives", "*=rigid,q=1N/um"], 'drives: unknown "q"'),
        ("orthoglide", ["--drives", "100"], '"100" needs a unit: N/um, kN/mm, N/mm'),
        ("orthoglide", ["--drives", "1e300N/um"], '"1e300N/um" is out of range'),
        ("orthoglide", ["--drives", "100N/um", "--force", "X=1e300N"], '--force: X: "1e300N" is out of range'),
        ("orthoglide", ["--drives=-1N/um"], "expected more than 0"),
        ("orthoglide", ["--drives", "1..2N/um"], 'drives: rho_x: "1..2N/um"'),
        ("orthoglide", ["--drives", "rigid"], "all are rigid, and so are the struts"),
        (
            "orthoglide",
            ["--drives", "1N/um", "--drives", "2N/um"],
            "--drives: 1N/um and 2N/um for all, expected them by names",
        ),
        ("orthoglide", ["--drives", "rho_x=1N/um,rho_x=2N/um"], "rho_x is given twice"),
        ("orthoglide", ["--drives", "1N/um", "--struts", "wall=2mm"], "struts: the diameter is missing"),
        ("orthoglide", ["--drives", "1N/um", "--struts", "diameter=2mm,wall=2mm"], "thicker than half the diameter"),
        ("orthoglide", ["--drives", "1N/um", "--struts", "diameter=20"], 'diameter: "20" needs a unit'),
        ("orthoglide", ["--drives", "1N/um", "--struts", "diameter=2mm,rods=x"], 'rods of "x", expected 1 to 9'),
        ("orthoglide", ["--drives", "1N/um", "--struts", "diametre=2mm"], 'struts: unknown "diametre"'),
        ("lambda6", ["--drives", "1N/um", "--struts", "9N/um"], "the short rod bends the long one"),
        ("eclipse", ["--drives", "*=rigid", "--struts", "diameter=9mm"], "those of kind column bend"),
        ("orthoglide", ["--drives", "1N/um", "--force", "X=5"], '--force: X: "5" needs a unit: N, kN'),
        ("tricept", ["--drives", "*=rigid", "--force", "B=5N"], "--force: B is no translation"),
        ("orthoglide", ["--drives", "1N/um", "--force", "Q=5N"], 'unknown axis "Q"'),
        ("orthoglide", ["--drives", "1N/um", "--along", "X"], "--along: goes with a map"),
        ("orthoglide", ["--drives", "1N/um", "--along", "B", "-o", "x.png"], '--along: "B", expected one of X Y Z'),
        ("orthoglide", ["--drives", "1N/um", "-o", "x.gif"], "expected a file name that ends in .png, .pdf, .svg"),
        ("orthoglide", ["--drives", "1N/um", "--samples", "0"], "--samples: a number from 1"),
        ("orthoglide", [], "--drives: the machine's file says no stiffness of rho_x"),
    ],
)
def test_what_is_mistaken_is_said_in_one_line(name, words, message, capsys):
    assert main(["stiffness", name, *words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert message in said.err


def test_the_library_refuses_what_fits_nothing():
    found = pk.analyse_stiffness(load_shipped("orthoglide"), "100 N/um", samples=5)
    with pytest.raises(pk.PoseError, match="it has no length"):
        found.along([0.0, 0.0, 0.0])
    with pytest.raises(pk.PoseError, match="force: one, or as many as the 5 poses"):
        found.deflect(np.zeros((4, 3)))
    with pytest.raises(pk.PoseError):
        found.deflect({"B": 1.0})
    assert np.isnan(pk.analyse_stiffness(found.machine, "100 N/um", None, [[900.0, 0.0, 0.0]]).least).all()


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "stiffness.py"
    done = subprocess.run([sys.executable, script, "-o", tmp_path], capture_output=True, text=True, check=True)
    assert "N/um at the worst" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["stiffness.png"]


def load_heavy(name, folder, platform):
    """A shipped machine whose platform alone has weight."""
    path = folder / f"{name}.yaml"
    bodies = "bodies:\n  rod: {mass: 1e-9 kg}\n  carriage: {mass: 1e-9 kg}\n  head: {mass: 1e-9 kg}\n"
    path.write_text(
        load_shipped(name).format_yaml() + bodies + f"  platform: {{mass: {platform} kg}}\n", encoding="utf-8"
    )
    return pk.load(path)


def test_finite_elements_sag_alike(tmp_path):
    """A platform's weight where its centre is, on the rigid body of the finite elements."""
    machine = load_heavy("hexapod", tmp_path, 150)
    poses = draw_poses(machine)
    (platform,) = (mass for name, mass in compute_masses(build_multibody(machine)).items() if name == "platform")
    sags = pk.analyse_stiffness(machine, "100 N/um", TUBE, poses).sag()
    for pose, sag in zip(poses, sags, strict=True):
        placed = machine.place_platform(pose, machine.mode)
        centre = np.array(placed.origin) + np.array(placed.rotation) @ platform.centre
        force = np.array([0.0, 0.0, -150.0 * 9.80665])
        wrench = np.concatenate([force, np.cross(centre - pose[:3], force)])
        assert sag == pytest.approx(compute_hexapod(machine, pose) @ wrench, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("name", ["tricept", "lambda6", "rotary_delta"])
def test_weight_on_drives_is_what_moves_them(name, tmp_path):
    """Drives that give way by their own forces at rest: the direct problem of the joints that are left."""
    machine = load_heavy(name, tmp_path, 60)
    pose = draw_poses(machine, 1)[0]
    stiff = {"mm": "100 kN/um", "rad": "9e5 kNm/rad"}
    stated = {joint: stiff[unit] for joint, unit in zip(machine.joints, machine.joint_units, strict=True)}
    found = pk.analyse_stiffness(machine, stated, None, [pose])
    joints = machine.inverse(pose)
    still = np.zeros((1, len(joints)))
    forces = Dynamics(machine).compute_forces(Motion(pose[None], joints[None], still, still))[0]
    given = joints - forces * found.springs.drives
    moved = machine.forward(given, near=pose).poses - pose
    tip = len(found.translations)
    assert found.sag()[0, :tip] == pytest.approx(moved[:tip], rel=1e-3, abs=1e-9)


def test_the_command_tells_the_sag(tmp_path, capsys):
    load_heavy("hexapod", tmp_path, 150)
    words = ["stiffness", str(tmp_path / "hexapod.yaml"), "--drives", "100N/um", "--samples", "9", "--weight"]
    assert main(words) == 0
    assert "its own weight moves the tip by" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    sag = json.loads(capsys.readouterr().out)["sag"]
    assert 0.0 < sag["median"] <= sag["worst"] < 0.1


@pytest.mark.parametrize("name", ["hexapod", "tricept", "rotary_delta"])
def test_a_loaded_machine_gives_way_by_its_equilibrium(name, tmp_path):
    """The joints at which soft springs hold weight and a force, found anew for each small force more."""
    machine = load_heavy(name, tmp_path, 60)
    pose = draw_poses(machine, 1)[0]
    stiff = {"mm": "0.2 N/um", "rad": "1 kNm/rad"}
    springs = {joint: stiff[unit] for joint, unit in zip(machine.joints, machine.joint_units, strict=True)}
    found = pk.analyse_stiffness(machine, springs, None, [pose])
    force, tip, dynamics = np.array([300.0, -200.0, -4000.0]), len(found.translations), Dynamics(machine)
    joints, compliance = machine.inverse(pose), found.springs.drives

    def ask(q, force):
        still = np.zeros((1, len(q)))
        given = machine.forward(q, near=pose).poses[None]
        return dynamics.compute_forces(Motion(given, q[None], still, still), force)[0]

    free = joints + compliance * ask(joints, force)  # where the drives stand, so that the loaded pose is this one

    def settle(force):
        q = joints
        for _ in range(60):
            q = free - compliance * ask(q, force)
        return machine.forward(q, near=pose).poses[:tip]

    steps = 20.0 * np.eye(tip)
    expected = np.column_stack([(settle(force + step) - settle(force - step)) / 40.0 for step in steps])
    loaded, unloaded = found.load(force).compliances[0, :tip, :tip], found.compliances[0, :tip, :tip]
    assert loaded == pytest.approx(expected, abs=2e-3 * np.abs(loaded - unloaded).max())
    assert np.abs(loaded - unloaded).max() > 5e-3 * np.abs(loaded).max()


def test_loads_on_rods_are_refused():
    found = pk.analyse_stiffness(load_shipped("orthoglide"), "100 N/um", {"diameter": "20 mm"}, samples=3)
    with pytest.raises(pk.PoseError, match="of kind slider"):
        found.load()
    with pytest.raises(pk.PoseError, match="force: one number each"):
        found.load(np.zeros((2, 3)))
