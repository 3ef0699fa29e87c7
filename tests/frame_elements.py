"""A small finite-element program: bars, beams of Euler and Bernoulli, springs to the ground, and rigid bodies."""

import numpy as np


class Frame:
    """Nodes have six freedoms. What moves with a body is led back to the body's six at its own point."""

    def __init__(self):
        self.points, self.elements, self.bodies, self.fixed = [], [], {}, []

    def node(self, point):
        self.points.append(np.asarray(point, float))
        return len(self.points) - 1

    def bar(self, i, j, stiffness):
        along = self.points[j] - self.points[i]
        along = along / np.linalg.norm(along)
        block = stiffness * np.outer(along, along)
        self._add([6 * i + k for k in range(3)] + [6 * j + k for k in range(3)], [[block, -block], [-block, block]])

    def spring(self, i, along, stiffness, first=0):
        along = np.asarray(along, float) / np.linalg.norm(along)
        self._add([6 * i + first + k for k in range(3)], [[stiffness * np.outer(along, along)]])

    def beam(self, i, j, axial, bending):
        """A beam with EA and EI (both ways), and a little torsion."""
        span = self.points[j] - self.points[i]
        length = np.linalg.norm(span)
        x = span / length
        y = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
        y /= np.linalg.norm(y)
        turn = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
        own = np.zeros((12, 12))
        own[np.ix_([0, 6], [0, 6])] = axial / length * np.array([[1, -1], [-1, 1]])
        own[np.ix_([3, 9], [3, 9])] = 1e-3 * bending / length * np.array([[1, -1], [-1, 1]])
        a, b, c, d = 12 * bending / length**3, 6 * bending / length**2, 4 * bending / length, 2 * bending / length
        bent = np.array([[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]])
        own[np.ix_([1, 5, 7, 11], [1, 5, 7, 11])] = bent
        sign = np.array([1, -1, 1, -1])
        own[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])] = bent * np.outer(sign, sign)
        self._add([6 * i + k for k in range(6)] + [6 * j + k for k in range(6)], turn.T @ own @ turn)

    def body(self, main, nodes):
        for node in nodes:
            self.bodies[node] = main

    def hold(self, i, freedoms):
        self.fixed += [6 * i + k for k in freedoms]

    def _add(self, rows, block):
        self.elements.append((rows, np.block(block) if isinstance(block, list) else block))

    def compliance(self, node, freedoms):
        """Solve for unit loads on freedoms of a node: the freedoms' ways, (n, n)."""
        size = 6 * len(self.points)
        whole = np.zeros((size, size))
        for rows, block in self.elements:
            whole[np.ix_(rows, rows)] += block
        led = np.eye(size)
        for slave, main in self.bodies.items():
            led[6 * slave : 6 * slave + 3] = 0.0
            for k in range(3):
                led[6 * slave + k, 6 * main + k] = 1.0
            x, y, z = self.points[slave] - self.points[main]
            led[6 * slave : 6 * slave + 3, 6 * main + 3 : 6 * main + 6] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        reduced = led.T @ whole @ led
        used = [k for k in range(size) if k not in self.fixed and np.abs(reduced[k]).max() > 0.0]
        loads = np.array([[float(k == 6 * node + f) for f in freedoms] for k in used])
        return loads.T @ np.linalg.solve(reduced[np.ix_(used, used)], loads)
