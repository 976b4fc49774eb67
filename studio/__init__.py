"""Capture Studio.

Matrices here are small: a second BLAS thread would only spin, and one thread adds up in one order, so that equal
input gives equal bits. It has to be said before numpy is first imported; `engine/blas.py` sees to the rest.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
