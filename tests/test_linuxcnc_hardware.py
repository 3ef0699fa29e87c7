"""Templates for cards: every pin exists in the driver's documents, HAL takes them, scales and homing are right."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from shipped import CONFIGURED, load_shipped

import parakin as pk
from parakin.cli import main
from parakin.controllers import Hardware
from parakin.controllers.linuxcnc.config import write_hal, write_ini
from parakin.controllers.linuxcnc.hardware import CARDS, equip_machine
from parakin.controllers.linuxcnc.home_pose import find_home_pose
from parakin.controllers.linuxcnc.homing import find_homing
from parakin.controllers.linuxcnc.homing.starts import compute_other_margins, compute_regularity, sample_starts
from parakin.controllers.linuxcnc.model_header import LEAST_REGULARITY
from parakin.controllers.linuxcnc.page import write_page

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from cards import check_wiring, exports_of, merge, programs, write_mock
from ini_file import read_ini
from parport_machine import driven_by_parport
from simulation import ALONE, AS_NOBODY, FIELDS, simulated, why_not

NAMES = CONFIGURED
EACH = [(name, card) for name in NAMES for card in CARDS]
PROGRAMS = ("loadusr", "source")
LATE = 1.0  # mm or degrees by which a switch may be found late: on a busy computer steps come late
REALTIME = "/usr/lib/linuxcnc/realtime"
WHY_NOT = why_not()
real = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)


@cache
def configuration(name, card):
    """The files that a card changes; making all of them takes long."""
    machine = load_shipped(name)
    equipment = equip_machine(machine, card)
    texts = {f"{name}.ini": write_ini(machine, equipment), f"{name}.hal": write_hal(machine, equipment)}
    return texts | {f"{name}.md": write_page(machine, equipment)} | dict(equipment.layout.files)


def test_the_command_knows_the_cards():
    assert set(CARDS) == set(Hardware.__args__)


@pytest.mark.parametrize(("name", "card"), EACH)
def test_pins_are_the_drivers(name, card):
    files = configuration(name, card)
    exports, hal = exports_of(files, name), files[f"{name}.hal"]
    joined = check_wiring(hal, exports)
    joints = len(load_shipped(name).joints)
    if card.startswith("mesa"):
        assert sum(pin.endswith(".velocity-cmd") for pin in joined) == joints
    if card == "parport":
        assert sum(signal.endswith(("-step", "-direction")) for signal in joined.values()) == 2 * joints
    if card == "ethercat":
        assert sum(pin.endswith(".srv-target-position") for pin in joined) == joints
    for signal in ("estop-open", "probe", "enabled", "spindle-on"):
        assert signal in joined.values()
    switches = sum(section.get("HOME_SEARCH_VEL", "0") != "0" for section in joint_sections(files, name))
    assert sum(bool(re.fullmatch(r"joint-\d+-home", signal)) for signal in joined.values()) == switches


def joint_sections(files, name):
    ini = read_ini(files[f"{name}.ini"])
    return [dict(ini[section]) for section in ini.sections() if section.startswith("JOINT_")]


@pytest.mark.parametrize(("name", "card"), EACH)
def test_functions_run_in_order(name, card):
    """What is read comes before the motion controller, what is written behind it, the card last."""
    files = configuration(name, card)
    hal, ini = files[f"{name}.hal"], read_ini(files[f"{name}.ini"])
    order = re.findall(r"^addf (\S+) servo-thread", hal, re.MULTILINE)
    motion = order.index("motion-controller")
    read = [i for i, function in enumerate(order) if re.search(r"\.read|read-all|capture-position", function)]
    write = [i for i, function in enumerate(order) if re.search(r"\.write|write-all|update-freq|do-pid", function)]
    assert read and max(read) < order.index("motion-command-handler") < motion < min(write)
    for section, key in re.findall(r"\[(\w+)\](\w+)", hal):
        assert key in ini[section]


@pytest.mark.parametrize(("name", "card"), EACH)
def test_no_card_is_asked_for_more_than_it_can(name, card):
    """Steps a second at full speed and a quarter more; a step with its pause lasts no longer than its period."""
    files = configuration(name, card)
    for section in joint_sections(files, name):
        rate = 1.25 * float(section["MAX_VELOCITY"]) * abs(float(section["SCALE"]))
        if card == "parport":
            period = float(read_ini(files[f"{name}.ini"])["EMCMOT"]["BASE_PERIOD"])
            assert rate <= 1e9 / period * (1.0 + 1e-9)
        elif card.startswith("mesa"):
            assert rate * (float(section["STEPLEN"]) + float(section["STEPSPACE"])) <= 1e9 * (1.0 + 1e-6)


MOTORS = """\
  counts: 2000
  lead: [10 mm, -10 mm, 5 mm]
"""


def with_motors(tmp_path, name="linear_delta", motors=MOTORS):
    text = (Path(pk.__file__).parent / "machines" / f"{name}.yaml").read_text(encoding="utf-8")
    path = tmp_path / f"{name}.yaml"
    path.write_text(text.replace("  jerk: ", f"{motors}  jerk: ", 1), encoding="utf-8")
    return path


def test_scales_are_counts_by_lead(tmp_path):
    machine = pk.load(with_motors(tmp_path))
    files = pk.make_linuxcnc_configuration(machine, "ethercat")
    assert [float(s["SCALE"]) for s in joint_sections(files, "linear_delta")] == [200.0, -200.0, 400.0]
    assert "is a guess" not in files["linear_delta.md"]
    turning = (Path(pk.__file__).parent / "machines" / "tricept.yaml").read_text(encoding="utf-8")
    turning = turning.replace("joint: theta2,", "joint: theta2, counts: 131072, lead: 3.6 deg, homing: 118 deg,")
    (tmp_path / "tricept.yaml").write_text(turning, encoding="utf-8")
    last = joint_sections(pk.make_linuxcnc_configuration(pk.load(tmp_path / "tricept.yaml"), "ethercat"), "tricept")[-1]
    assert float(last["SCALE"]) == pytest.approx(131072 / 3.6)
    assert float(last["HOME_OFFSET"]) == 118.0
    assert float(last["HOME_SEARCH_VEL"]) > 0.0 > float(last["HOME_LATCH_VEL"])


def test_what_a_card_cannot_drive_is_refused(tmp_path, capsys):
    fast = with_motors(tmp_path)
    assert main(["linuxcnc", str(fast), "--hardware", "parport", "-o", str(tmp_path / "out")]) == 2
    assert "250000 steps a second" in capsys.readouterr().err  # 1000 mm/s at 200 steps a mm, and a quarter
    assert not (tmp_path / "out").exists()
    alone = with_motors(tmp_path, motors="  counts: 2000\n")
    assert main(["linuxcnc", str(alone), "--hardware", "ethercat", "-o", str(tmp_path / "out")]) == 2
    assert "joint tower_a has no lead" in capsys.readouterr().err
    with pytest.raises(pk.ParakinError, match='unknown card "mesa"'):
        pk.make_linuxcnc_configuration(pk.load("tricept"), "mesa")


def test_the_command_writes_a_template(tmp_path, capsys):
    out = tmp_path / "cnc"
    assert main(["linuxcnc", "tricept", "--hardware", "ethercat", "-o", str(out)]) == 0
    assert "tricept_ethercat.xml" in capsys.readouterr().out
    page = (out / "tricept.md").read_text(encoding="utf-8")
    for word in ("What is left to the hand", "emergency stop", "home switch of d1", "Samples are no proof"):
        assert word in page


def replace_drivers(machine, hal):
    """The template without what needs a card or a program of LinuxCNC's; trial_card exports in their place."""
    lines = ["loadrt homemod", "loadrt [TRAJ]TPMOD", "loadrt trial_card"]  # the first two by LinuxCNC itself
    for line in hal.split("\n"):
        if line.startswith("loadrt hal_parport"):
            names = ",".join(f"parport.{i}" for i in range(line.count(" out") + line.count(" in")))
            lines.append(f"loadrt sim_parport names={names}")
        elif not line.startswith(("loadrt hostmot2", "loadrt hm2_eth", "loadrt lcec", "loadrt cia402", *PROGRAMS)):
            lines.append(line)
    return "\n".join(lines)


def load_hal(machine, card, folder):
    """Load a card's HAL file with the real halcmd; return the process."""
    files = configuration(machine.name, card)
    exports = programs() if card == "parport" else merge(exports_of(files, machine.name), programs())
    exports.pins |= {f"ENCODER-{joint}": ("float", "OUT") for joint in machine.joints}
    (folder / "trial_card.c").write_text(write_mock("trial_card", exports), encoding="utf-8")
    (folder / "card.ini").write_text(files[f"{machine.name}.ini"], encoding="utf-8")
    (folder / "card.hal").write_text(replace_drivers(machine, files[f"{machine.name}.hal"]), encoding="utf-8")
    load = f"{REALTIME} start && halcmd -i card.ini -f card.hal && halcmd show thread"
    subprocess.run(["halcompile", "--compile", "trial_card.c"], cwd=folder, check=True, capture_output=True)
    command = [*ALONE, *AS_NOBODY, f"HOME={folder}", "sh", "-c", f"{load}; code=$?; halrun -U; exit $code"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)


@real
@pytest.mark.parametrize("name", ["tricept", "hexapod"])
def test_hal_takes_every_card(name):
    """The real halcmd joins all pins: of the real motion controller, loops and ports, and of the driver's documents."""
    machine = load_shipped(name)
    with simulated(machine) as simulation:
        for card in CARDS:
            done = load_hal(machine, card, simulation.folder)
            assert done.returncode == 0, card + done.stdout + done.stderr
            assert "motion-controller" in done.stdout


def choose_start(machine):
    """Joints from which homing is tried: tilted or aside, with little way to the switches, in far corners else."""
    starts, plan = sample_starts(machine), find_homing(machine)
    switched = [i for i, joint in enumerate(plan.joints) if joint.switch is not None]
    if not switched:
        return starts.joints[0], starts.poses[0]
    travel = [drive.high - drive.low for drive in machine.drives]
    far = np.abs(starts.joints - [joint.switch or 0.0 for joint in plan.joints]) / travel
    spread = np.ptp(starts.joints[:, : machine.leg_count], axis=1) / max(travel)
    best = int((spread - 2.0 * far[:, switched].max(1)).argmax())
    return starts.joints[best], starts.poses[best]


def follow(machine, rows, pose):
    """The poses (n, axes) that joints (n, joints) pull the machine to, from one on; every step must close."""
    poses = []
    for joints in rows:
        solution = machine.forward(joints, near=pose)
        assert solution.converged, joints
        pose = solution.poses
        poses.append(pose)
    return np.array(poses)


@real
@pytest.mark.parametrize("name", ["linear_delta", "tricept", "hexapod"])
def test_homing_keeps_off_singularities(name):
    """LinuxCNC homes the template: the joints go home on home's side of all singularities, and it knows the pose.

    Then the emergency stop's contact opens: the machine is off at once, and can be switched on again.
    """
    machine = load_shipped(name)
    joints, pose = choose_start(machine)
    plan, home = find_homing(machine), machine.inverse(find_home_pose(machine))
    turning = np.array(machine.joint_units) == "rad"
    switched = np.array([joint.switch is not None for joint in plan.joints])
    with driven_by_parport(machine, joints) as simulation:
        (seen, stopped), rows = simulation.operate([["mdi", "G21 G90"], ["interrupt", "parport.0.pin-10-in-fake"]])
    assert seen["on"]
    assert not stopped["on"]
    places = np.where(turning, np.radians(rows[:, 1:]), rows[:, 1:])
    assert np.abs(places[0] - joints).max() < 1e-5
    assert rows[:, 0].max() == 1.0
    expected = np.where(switched, home, joints)
    assert np.abs(places[-1] - expected)[~turning].max() < LATE
    assert np.abs(places[-1] - expected)[turning].max(initial=0.0) < np.radians(LATE)
    told = np.where(turning, np.radians(seen["joints"]), seen["joints"])
    assert np.abs(told - places[-1])[~turning].max() < LATE
    if switched[: machine.leg_count].any():
        assert np.abs(places - joints)[:, : machine.leg_count].max() > 50.0  # it did go
    else:
        assert np.abs(places - joints).max() < 1e-5
    moved = np.flatnonzero(np.abs(np.diff(places, axis=0)).max(1) > 0.0)
    thinned = places[np.unique([0, *moved[::20], len(places) - 1])]
    poses = follow(machine, thinned, pose)
    assert np.sign(machine.sides(poses)) == pytest.approx(np.sign(machine.sides(machine.home[None])[0]))
    assert compute_regularity(machine, poses).min() > LEAST_REGULARITY
    assert compute_other_margins(machine, poses, thinned).min() >= 0.0
    shown = [seen["position"][FIELDS.index(axis)] for axis in machine.axes]
    units = np.where(np.array(machine.axis_units) == "rad", np.pi / 180.0, 1.0)
    straight = np.array(machine.axis_units) == "mm"
    assert np.abs(np.array(shown) * units - poses[-1])[straight].max() < 5.0 * LATE
