"""A designed machine as a machine file."""

from __future__ import annotations

from ..performance.design import Design


def format_design_yaml(design: Design) -> str:
    """Format the machine file of a designed Orthoglide, with all digits of its sizes."""
    low, high = design.stroke
    corner, other = design.cube
    least, greatest = (bracket.attained for bracket in design.proof.brackets)
    return f"""\
# An Orthoglide designed for a cube: its velocity amplifications psi stay between 1/{design.amplification:.9g} and \
{design.amplification:.9g}
# all over it (they go from {least:.6f} to {greatest:.6f}); proved by intervals to {design.proof.tolerance:g}.
# The cube reaches from {corner:.6f} mm to {other:.6f} mm on each axis.
title: Orthoglide for a cube of {design.edge:.9g} mm
source: >
  D. Chablat, P. Wenger, A New Three-DOF Parallel Mechanism: Milling Machine Applications, Chemnitz (2000). The rods'
  length and the strokes follow from its condition on the velocity amplification.
sizes: {{L: {design.rod!r} mm}}
motion: tx ty tz
legs:
  kind: slider
  joints: [rho_x, rho_y, rho_z]
  foot: [0, 0, 0]
  rail: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
  rod: L  # the mean one of each parallelogram
  branch: "+"
  platform: [0, 0, 0]
  range: [{low!r} mm, {high!r} mm]
home: {{X: 0 mm, Y: 0 mm, Z: 0 mm}}  # the isotropic point
"""
