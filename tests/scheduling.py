"""How many processes run the tests, and which: half begin with those in real time, half with those that compute.

The first kind waits at times. Then the second, which gives way to it, uses its cores. A process that has none of its
kind left goes on with the other.
"""

import os
from typing import TYPE_CHECKING

from xdist.scheduler import LoadScopeScheduling

if TYPE_CHECKING:
    from xdist.workermanage import WorkerController

REAL_TIME = (
    *(f"tests/{name}/" for name in ("acceptance", "web", "live")),
    "tests/engine/animation/export/test_glb.py",
    "tests/security/test_page.py",
)
"""Tests with browsers and with programs that run in real time."""

FIRST = ("tests/test_guards.py", "tests/test_site.py", "tests/test_examples.py")
"""Files that take minutes: begun last, they would keep one core busy after all others."""


NICENESS = 5
"""By how much those that compute give way."""


def processes() -> int:
    """How many processes run the tests at the same time."""
    return 2 * (os.cpu_count() or 1)


def begins_in_real_time(worker: str) -> bool:
    """Whether the process of that name (gw0, gw1, ...) begins with tests in real time."""
    return int(worker.removeprefix("gw")) % 2 == 0


class Scheduling(LoadScopeScheduling):
    """Gives whole files to processes."""

    def _split_scope(self, nodeid: str) -> str:
        return nodeid.split("::")[0]

    def _assign_work_unit(self, node: "WorkerController") -> None:
        wanted = begins_in_real_time(node.gateway.id)
        left = [name for name in self.workqueue if name.startswith(REAL_TIME) == wanted]
        scope = min(left, key=lambda name: name not in FIRST, default=None)
        if scope is not None:
            self.workqueue.move_to_end(scope, last=False)
        super()._assign_work_unit(node)
