"""Compiling ahead: what the live stage, finishing, depth and exports call is compiled."""

from studio.engine.animation.curves import keys
from studio.engine.seeing.fitting import fit
from studio.engine.seeing.tracker import view
from studio.engine.solve.kalman import kernels
from studio.offline.compiling import STEPS, compile_ahead


def test_its_steps_run_the_solver_the_tracker_and_an_export():
    for step in STEPS:
        step()
    for module in (kernels, fit, view, keys):
        compiled = [value for value in vars(module).values() if getattr(value, "signatures", None)]
        assert compiled, f"{module.__name__} has nothing compiled"


def test_it_tells_its_progress():
    shares = []
    compile_ahead(shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
