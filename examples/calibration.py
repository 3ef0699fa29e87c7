"""A Tricept whose numbers are a little off is measured, calibrated, and measured again where it was not before.

python examples/calibration.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import parakin as pk


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    folder = parser.parse_args().output
    drawn = pk.load("tricept")
    plan = pk.plan_measurements(drawn, 40)  # poses that tell the machine's numbers best
    print(plan)

    # The machine as built: feet and joints some 0.2 mm off, drives' zeros too, the wrist's by 0.01 degrees.
    rng = np.random.default_rng(0)
    family = pk.family(drawn, ["feet", "platform", "encoders"])
    spread = np.array([0.2 if parameter.unit == "mm" else 2e-4 for parameter in family.parameters])
    built = family.at(family.nominal + rng.normal(0.0, spread))

    # The controller goes to the planned joints, a laser tracker measures the tool there to 10 micrometres.
    poses = built.forward(plan.joints, near=plan.poses).poses
    noise = pk.Noise(length=0.01, angle=2e-5)
    measured = poses + rng.normal(0.0, [noise.length] * 3 + [noise.angle] * 2, poses.shape)
    measured[:, 4] = poses[:, 4] + (measured[:, 4] - poses[:, 4]) / np.sin(poses[:, 3])

    result = pk.calibrate(drawn, pk.make_measurements(drawn, plan.joints, measured, noise=noise))
    print(result)
    check = drawn.home + rng.uniform(-1.0, 1.0, (200, 5)) * [200.0, 200.0, 100.0, 0.3, 0.3]
    joints = built.inverse(check)
    for name, machine in (("as drawn", drawn), ("calibrated", result.machine)):
        errors = np.linalg.norm((machine.forward(joints, near=check).poses - check)[:, :3], axis=1)
        print(f"{name}: the tip is {1e3 * np.sqrt((errors**2).mean()):.1f} um off, root mean square of 200 poses")

    picture, text = pk.render_residuals(result), pk.format_calibrated_yaml(result)
    files = {"calibration.png": picture, "tricept_calibrated.yaml": text}
    for path in pk.write_files(folder, files):
        print(path)


if __name__ == "__main__":
    main()
