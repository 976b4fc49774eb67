"""Capture Studio: markerless motion capture from several cameras, for programs.

    import studio

    take = studio.import_take("recording", "takes/punches")
    studio.calibrate(take)
    poses = studio.solve(take, "finish")
    studio.export(poses, "punches.fbx")

The names in `__init__.pyi` are public and stable within a major version. All others may change. `examples/` has
runnable programs.
"""

import os
from importlib import metadata

import lazy_loader

# Matrices here are small. A second BLAS thread would only wait, and one thread sums in one order, so that equal
# input gives equal bits. This must be set before numpy is first imported; `engine/base/blas.py` covers the other
# case.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = metadata.version("capture-studio")
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
