"""The wrist: two turning axes that point the tool, their two working modes, and the pole between these.

Two pairs of angles point a tool: the turning joints of head and table (``turning_joints.py``), and B and C of a pose
whose orientation is the tool's axis only (``pose_angles.py``). Of each pair the *first* axis carries the *second*. Two
values of the pair, its two modes, point the tool the same way. They meet on the *pole*, where the tool's axis lies
along the first axis: there the first angle is free, and close by it swings. A path that passes over the pole goes on in
the other mode, so that the first angle need not turn by half a turn; the second changes its sign instead.

``pole_crossing.py`` tells where that is so, for both pairs. Who asks it: a path of poses in :mod:`~..follow`; one point
after the other in ``toolpath/linearise/continuation.py``; a tool path is led through the pole in
``toolpath/linearise/pole_passes.py``; ``toolpath/checking/motions.py`` proves that nothing else happens;
``controllers/linuxcnc/core.c`` does the same as ``follow`` in the controller. All thresholds at poles stand in
``pole_thresholds.py``.
"""
