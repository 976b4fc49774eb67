"""Which process runs which tests: one begins with those in real time, the others with those that compute.

The first kind waits more than it computes, so both kinds together keep the machine busy. A process that has none of
its kind left goes on with the other.
"""

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


class Scheduling(LoadScopeScheduling):
    """Gives whole files to processes."""

    def _split_scope(self, nodeid: str) -> str:
        return nodeid.split("::")[0]

    def _assign_work_unit(self, node: "WorkerController") -> None:
        wanted = node is self.nodes[0]
        scope = next((name for name in self.workqueue if name.startswith(REAL_TIME) == wanted), None)
        if scope is not None:
            self.workqueue.move_to_end(scope, last=False)
        super()._assign_work_unit(node)
