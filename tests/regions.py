"""Regions of all components: what the limits alone allow, in every assembly mode."""

from __future__ import annotations

import parakin as pk


def whole_region(machine, *arguments, **options):
    return pk.region(machine, *arguments, **{"components": "all", **options})
