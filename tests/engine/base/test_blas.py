"""One thread for linear algebra, whatever a process imported before the studio."""

import os
import subprocess
import sys


def test_one_blas_thread_whatever_was_imported_first():
    """A process that loads numpy with several BLAS threads before the studio computes the same."""
    program = """
import sys
if sys.argv[1] == "numpy":
    import numpy, scipy.linalg
import studio.engine.solve.pipeline
from threadpoolctl import threadpool_info
assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} == {1}
"""
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    for first in ("numpy", "studio"):
        subprocess.run([sys.executable, "-c", program, first], check=True, env=environment)
