"""The exported model in MuJoCo, its loops closed by Newton's method on MuJoCo's own constraints."""

import mujoco
import numpy as np

from parakin.export.machine.mjcf import render_mjcf

METRE = 1000.0  # mm


class Engine:
    """A model whose drives are set and whose other joints follow by Newton on MuJoCo's own constraints."""

    def __init__(self, machine):
        self.model = mujoco.MjModel.from_xml_string(render_mjcf(machine))
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
        self.data = mujoco.MjData(self.model)
        driven = [self.model.joint(name) for name in machine.joints]
        self.places = np.array([joint.qposadr[0] for joint in driven])
        self.driven = np.array([joint.dofadr[0] for joint in driven])
        self.free = np.setdiff1d(np.arange(self.model.nv), self.driven)
        self.units = np.array([METRE if unit == "mm" else 1.0 for unit in machine.joint_units])

    def reset(self):
        mujoco.mj_resetData(self.model, self.data)

    def drive(self, joints):
        """Set the drives, close the loops, and return what does not close, m."""
        self.data.qpos[self.places] = joints / self.units
        for _ in range(30):
            mujoco.mj_forward(self.model, self.data)
            count = self.data.ne
            gaps = self.data.efc_pos[:count].copy()
            if np.abs(gaps).max() < 1e-13:
                break
            jacobian = self.data.efc_J.reshape(-1, self.model.nv)[:count, self.free]
            step = np.zeros(self.model.nv)
            step[self.free] = -np.linalg.lstsq(jacobian, gaps, rcond=1e-10)[0]
            mujoco.mj_integratePos(self.model, self.data.qpos, step, 1.0)
        return np.abs(gaps).max()

    def read(self):
        """The tool's tip, mm, and its rotation, in the workpiece's frame."""
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, self.data.sensor("tool_orientation").data)
        return self.data.sensor("tool_position").data * METRE, turn.reshape(3, 3)

    def read_forces(self, speeds, accelerations):
        """The drives' forces, N and Nm, for their rates in m, rad and s, as the drives stand.

        The other joints' rates follow from MuJoCo's constraints; no bar between ball joints spins about itself. Its
        Newton-Euler gives each joint's force, and the loops' forces leave none for the free joints.
        """
        model, data, matrix = self.model, self.data, self._read_loops()
        of_drives, of_free = matrix[:, self.driven], matrix[:, self.free]
        velocities, wanted = np.zeros(model.nv), np.zeros(model.nv)
        velocities[self.driven], wanted[self.driven] = speeds, accelerations
        velocities[self.free] = -np.linalg.lstsq(of_free, of_drives @ speeds, rcond=1e-9)[0]
        data.qvel[:] = velocities
        mujoco.mj_forward(model, data)
        bend = self._read_loop_rates() @ velocities
        wanted[self.free] = -np.linalg.lstsq(of_free, of_drives @ accelerations + bend, rcond=1e-9)[0]
        data.qacc[:] = wanted
        forces = np.empty(model.nv)
        mujoco.mj_rne(model, data, 1, forces)
        loops = np.linalg.lstsq(of_free.T, forces[self.free], rcond=1e-9)[0]
        assert np.abs(forces[self.free] - of_free.T @ loops).max() < 1e-7 * np.abs(forces).max()
        return forces[self.driven] - of_drives.T @ loops

    def _read_loops(self):
        """The Jacobian of what the loops, and bars that do not spin about themselves, hold: (rows, dofs)."""
        return self._list_rows(mujoco.mj_jac)

    def _read_loop_rates(self):
        """Its time derivative, where no bar spins."""
        return self._list_rows(mujoco.mj_jacDot)

    def _list_rows(self, compute):
        model, data, rows = self.model, self.data, []

        def read(place, body):
            jacobians = np.empty((2, 3, model.nv))
            compute(model, data, *jacobians, place, body)
            return jacobians

        for loop in range(model.neq):
            sites = model.eq_obj1id[loop], model.eq_obj2id[loop]
            first, second = (read(data.site_xpos[site], model.site_bodyid[site])[0] for site in sites)
            rows.append(first - second)
        for ball in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL):
            if model.jnt(ball).name == "central":  # its platform turns about it
                continue
            body = model.jnt_bodyid[ball]
            family = (model.geom_bodyid == body) | (model.body_parentid[model.geom_bodyid] == body)
            bar = np.flatnonzero(family & (model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE))[0]
            along = data.geom_xmat[bar].reshape(3, 3)[:, 2]
            rows.append(along[None] @ read(data.geom_xpos[bar], model.geom_bodyid[bar])[1])
        return np.vstack(rows)
