"""``python -m parakin.studio.parent_watch PIPE MODULE WORDS...``: run a module that ends when its parent does.

The system closes a process's pipes however it ends, so that the other end tells where it was killed, too.
"""

from __future__ import annotations

import os
import runpy
import signal
import sys
import threading
import time

PATIENCE = 3.0  # s for a process to remove its half-written files


def _end_with(pipe: int) -> None:
    """Wait until nobody can write to a pipe, and end this process's group: asked first, then at once."""
    while os.read(pipe, 1):
        pass
    os.killpg(0, signal.SIGTERM)
    time.sleep(PATIENCE)
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    _, pipe, module, *words = sys.argv
    threading.Thread(target=_end_with, args=(int(pipe),), daemon=True).start()
    sys.argv = [module, *words]
    runpy.run_module(module, run_name="__main__", alter_sys=True)
