"""One BLAS thread from here on, also where numpy was imported before `studio` could say so.

With two threads, products of matrices of some hundred rows add up in another order: the last bits of a solve would
depend on what a process imported first, and as-live would not equal live.
"""

import numpy as np  # noqa: F401, the library must be loaded to be told
import scipy.linalg  # noqa: F401, it has a BLAS of its own
from threadpoolctl import threadpool_limits

threadpool_limits(limits=1, user_api="blas")
