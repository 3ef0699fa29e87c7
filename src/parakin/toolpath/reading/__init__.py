"""Readers of CL files (``cl``) and G-code (``gcode``); ``detect`` chooses between them.

The words of each are in one table: :mod:`.cl.words` and :mod:`.gcode.codes`. A reader splits the file into lines
(``reader``), sends runs of plain lines through a fast reader (``plain_lines``), executes the others one by one
(``statements`` and ``actions``; ``block`` and ``execution``), and keeps modal state and records in ``motion``.
"""
