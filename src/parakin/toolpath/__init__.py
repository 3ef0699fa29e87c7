"""From a CL file or G-code to a job: read, posted, checked everywhere, linearised, timed and placed.

``path.py`` is the neutral tool path that every reader makes; ``job.py`` puts the steps together.
"""
