"""The turn of the tool about its own axis, chosen along a whole path by machines that turn three ways.

``choice`` leads through it: ``stations`` stand evenly along the path, a ``lattice`` has many turns at each of them,
``lattice_search`` finds the way through it, and ``turned_path`` gives the path's records the turns of that way.
"""
