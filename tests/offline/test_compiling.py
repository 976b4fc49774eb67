"""Compiling ahead: what the live stage, finishing, depth and exports call is compiled."""

from types import ModuleType

import pytest

from studio.engine.animation.curves import keys
from studio.engine.seeing.fitting import fit
from studio.engine.seeing.tracker import view
from studio.engine.solve.kalman import kernels
from studio.offline import compiling
from studio.offline.compiling import STEPS, compile_ahead


def solve() -> None:
    """The first step, and what it compiled in its process."""
    STEPS[0]()
    check_compiled(kernels, keys)


def see() -> None:
    """The second step, and what it compiled in its process."""
    STEPS[1]()
    check_compiled(fit, view)


def check_compiled(*modules: ModuleType) -> None:
    for module in modules:
        compiled = [value for value in vars(module).values() if getattr(value, "signatures", None)]
        assert compiled, f"{module.__name__} has nothing compiled"


@pytest.fixture(scope="module")
def shares() -> list[float]:
    """The progress of all steps, each with a look at what it compiled."""
    assert len(STEPS) == 2
    told: list[float] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiling, "STEPS", (solve, see))
        compile_ahead(told.append)
    return told


def test_its_steps_run_the_solver_the_tracker_and_an_export(shares):
    assert len(shares) == len(STEPS)


def test_it_tells_its_progress(shares):
    assert shares == sorted(shares) and shares[-1] == 1.0
