"""Kinematics modules without LinuxCNC: built by gcc against a stub of the HAL, called through ctypes."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np

from parakin.controllers.linuxcnc.kinematics_module import name_kinematics, write_module
from parakin.controllers.linuxcnc.model_header import list_limit_names, name_model, write_model

HERE = Path(__file__).parent
HEADERS = ("rtapi.h", "rtapi_app.h", "rtapi_math.h", "rtapi_string.h", "hal.h", "kinematics.h", "emcmotcfg.h")
PLANNER_HEADERS = ("motion.h", "tp.h", "emccfg.h")
# As LinuxCNC's Makefile.modinc compiles a module.
FLAGS = ["-Os", "-fno-fast-math", "-mieee-fp", "-fno-unsafe-math-optimizations", "-fno-builtin-sincos"]
FLAGS += ["-fno-builtin-sin", "-fno-builtin-cos", "-D_GNU_SOURCE", "-DRTAPI", "-fPIC"]
FIELDS = "XYZABCUVW"
LOADED: list[ctypes.CDLL] = []


def _pointer(array):
    return array.ctypes.data_as(ctypes.c_void_p)


class Kinematics:
    """The functions of a kinematics module; mm and degrees, as LinuxCNC has them."""

    def __init__(self, stub, path, width):
        self.stub, self.width = stub, width
        self.library = ctypes.CDLL(str(path))
        assert self.library.rtapi_app_main() == 0
        assert ctypes.c_int.in_dll(stub, "stub_ready").value == 1
        offset = ctypes.POINTER(ctypes.c_double).in_dll(stub, "stub_tool_offset")
        self.tool_offset = offset.contents if offset else None  # mm; LinuxCNC's own modules have none of this name
        pins = (ctypes.POINTER(ctypes.c_double) * 16).in_dll(stub, "stub_joint")
        self.commanded = [pin.contents if pin else None for pin in pins]
        self.coordinated = ctypes.POINTER(ctypes.c_char).in_dll(stub, "stub_coordinated")
        self.exported = stub.stub_count()  # its functions are the last

    def command(self, joints):
        """Tell where the joints are commanded to be, mm and degrees."""
        for pin, value in zip(self.commanded, joints, strict=False):
            pin.value = value

    def coordinate(self, coordinated):
        """Tell whether LinuxCNC moves the machine's pose."""
        self.coordinated[0] = int(coordinated)

    def watch_steps(self, watched):
        """Let the inverse refuse steps that no drive can follow, as within a servo cycle, or not."""
        assert self.stub.stub_run(b"kins.begin-steps" if watched else b"kins.end-steps", self.exported)

    def jacobian(self, joints, pose):
        """The joints' rates by the pose's coordinates, (width, 9) in LinuxCNC's units, and the code."""
        rates, flags = np.full((16, 9), np.nan), ctypes.c_ulong(0)
        given = [np.ascontiguousarray(row, float) for row in (joints, pose)]
        code = self.library.kinematicsJacobian(*map(_pointer, [*given, rates]), ctypes.byref(flags))
        return rates[: self.width], code

    def _call(self, name, function, count, *arrays):
        codes = np.full(count, 99, np.int32)
        address = ctypes.cast(getattr(self.library, function), ctypes.c_void_p)
        getattr(self.stub, name)(
            address, ctypes.c_long(count), ctypes.c_long(self.width), *map(_pointer, arrays), _pointer(codes)
        )
        return codes

    def forward(self, joints, starts):
        """Poses (n, 9) and codes (n,) for joints (n, width), each from its start (n, 9)."""
        poses = starts.copy()
        return poses, self._call("stub_forward", "kinematicsForward", len(joints), np.ascontiguousarray(joints), poses)

    def forward_path(self, joints, start):
        """As :meth:`forward`, each from the pose before, the first from ``start`` (9,)."""
        poses, pose = np.empty((len(joints), 9)), start.copy()
        given = np.ascontiguousarray(joints)
        return poses, self._call("stub_forward_path", "kinematicsForward", len(joints), given, pose, poses)

    def inverse(self, poses, last):
        """Joints (n, width) and codes (n,) for poses (n, 9), each near its last joints (n, width)."""
        joints = np.ascontiguousarray(last).copy()
        return joints, self._call("stub_inverse", "kinematicsInverse", len(poses), np.ascontiguousarray(poses), joints)

    def inverse_path(self, poses, last):
        """As :meth:`inverse`, each near the joints before, the first near ``last`` (width,)."""
        joints, joint = np.empty((len(poses), self.width)), last.copy()
        given = np.ascontiguousarray(poses)
        return joints, self._call("stub_inverse_path", "kinematicsInverse", len(poses), given, joint, joints)


class Stub:
    """The stub HAL and the modules built against it, in a folder of their own."""

    def __init__(self, folder):
        self.folder = Path(folder)
        for name in HEADERS:
            (self.folder / name).write_text('#include "stub_hal.h"\n')

    @property
    def library(self):
        """The one library of this process: modules find the first that was loaded."""
        if not LOADED:
            self.compile([HERE / "stub_hal.c"], self.folder / "stub_hal.so")
            LOADED.append(ctypes.CDLL(str(self.folder / "stub_hal.so"), mode=ctypes.RTLD_GLOBAL))
        return LOADED[0]

    def compile(self, sources, target):
        """Compile sources, and options for them, to a library; a warning is an error."""
        warnings = ["-Wall", "-Wextra", "-Werror", "-Wframe-larger-than=3072"]
        command = ["gcc", *FLAGS, *warnings, f"-I{HERE}", f"-I{self.folder}", "-shared", "-o", target, *sources, "-lm"]
        subprocess.run(command, check=True)

    def built(self, machine, *options, box=None):
        """A machine's module, which knows a box of poses that are proved to be good, or measures each."""
        stub, name = self.library, name_kinematics(machine)
        source = self.folder / f"{name}.c"
        source.write_text(write_module(machine, box))
        (self.folder / name_model(machine)).write_text(write_model(machine))
        self.compile([*options, source], self.folder / f"{name}.so")
        return Kinematics(stub, self.folder / f"{name}.so", len(machine.joints))

    def probe(self, machine):
        """The functions of a machine's model that all modules share, in mm and rad."""
        (self.folder / name_model(machine)).write_text(write_model(machine))
        path = self.folder / f"{machine.name}_probe.so"
        self.compile([f'-DMODEL_HEADER="{name_model(machine)}"', HERE / "model_probe.c"], path)
        return ModelProbe(ctypes.CDLL(str(path)), machine)


class ModelProbe:
    """The model's functions over rows of poses (n, axes) and joints (n, joints), mm and rad."""

    def __init__(self, library, machine):
        self.library, self.sizes = library, (len(machine.joints), len(machine.axes))
        self.names = list_limit_names(machine)

    def rates(self, poses, joints):
        """dq/dx (n, joints, axes), and whether the machine is not singular there (n,)."""
        rates, codes = np.empty((len(poses), *self.sizes)), np.empty(len(poses), np.int32)
        self._call("probe_rates", poses, joints, rates, codes)
        return rates, codes != 0

    def singularities(self, poses, joints):
        """The singularity margins (n, margins)."""
        margins = np.empty((len(poses), sum(name.startswith("singularity") for name in self.names)))
        self._call("probe_singularities", poses, joints, margins)
        return margins

    def distances(self, poses, joints):
        """The distance to the nearest limit (n,), and its names."""
        distances, nearest = np.empty(len(poses)), np.empty(len(poses), np.int32)
        self._call("probe_distances", poses, joints, distances, nearest)
        return distances, [self.names[i] for i in nearest]

    def tell_pose(self, margins, share):
        """Whether joints tell their pose where the singularity margins (n, margins) are so far off, (n,)."""
        margins, codes = np.ascontiguousarray(margins), np.empty(len(margins), np.int32)
        self.library.probe_telling(
            ctypes.c_long(len(margins)), _pointer(margins), ctypes.c_double(share), _pointer(codes)
        )
        return codes != 0

    def _call(self, name, poses, joints, *arrays):
        given = [np.ascontiguousarray(rows, float) for rows in (poses, joints)]
        getattr(self.library, name)(ctypes.c_long(len(poses)), *map(_pointer, [*given, *arrays]))


def world(machine, poses):
    """Poses as LinuxCNC has them, (n, 9): X Y Z A B C U V W in mm and degrees."""
    rows = np.zeros((len(poses), 9))
    for i, (axis, unit) in enumerate(zip(machine.axes, machine.axis_units, strict=True)):
        rows[:, FIELDS.index(axis)] = np.degrees(poses[:, i]) if unit == "rad" else poses[:, i]
    return rows


def pose(machine, rows):
    """The other way round."""
    values = rows[:, [FIELDS.index(axis) for axis in machine.axes]]
    return np.where(np.array(machine.axis_units) == "rad", np.radians(values), values)


def outward(machine, joints):
    """Joints as LinuxCNC has them, in mm and degrees."""
    return np.where(np.array(machine.joint_units) == "rad", np.degrees(joints), joints)


def inward(machine, joints):
    """The other way round."""
    return np.where(np.array(machine.joint_units) == "rad", np.radians(joints), joints)
