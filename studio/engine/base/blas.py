"""Limits BLAS to one thread, also where numpy was imported before `studio`.

With two threads, matrix products of some hundred rows are summed in another order. The last bits of a solve would
then depend on import order, and as-live would differ from live.
"""

import numpy as np  # noqa: F401, the library must be loaded before it can be limited
import scipy.linalg  # noqa: F401, SciPy has a BLAS of its own
from threadpoolctl import threadpool_limits

threadpool_limits(limits=1, user_api="blas")
