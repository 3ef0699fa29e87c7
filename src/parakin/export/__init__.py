"""What people read: pictures, pages, tables and files of machines, workspaces and tool paths.

An export is a function that takes a finished result and returns text, bytes or a writer, in the folder of what it shows
(``machine/``, ``workspace/``, ``report/``, ``tables/``, ``json/``). ``files.py`` alone writes files, a set or none.
"""
