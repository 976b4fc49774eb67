"""Importing this module loads the code of a solve, and runs all that is slow at its first call.

It is named as a text where processes begin: the server itself must not import it.
"""

import importlib
import logging
import signal

from studio.engine.base.loading import loading
from studio.engine.base.system import leave_out_windows

MODULES = (
    "studio.offline.replay",
    "studio.engine.animation.export",
    "studio.offline.warming",
    "scipy.signal",  # 0.3 s of each process that measures a solve
)
"""What is imported; `prepare` of those that have one is called."""

leave_out_windows()
signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends this process

with loading():
    for _name in MODULES:
        try:
            getattr(importlib.import_module(_name), "prepare", lambda: None)()
        except Exception:  # boundary of the process: its works load what it could not prepare
            logging.getLogger(__name__).exception("%s could not be loaded in advance", _name)
