"""No figure of the fixed set gets worse by more than its noise.

The noise is the standard deviation of each figure over six takes of the same motion that differ by the seed
of their simulated noise, seeds that fail altogether left out (`python -m tests.regression --noise`). A change
that is meant to alter figures updates the file with `python -m tests.regression --update`, in the same
commit.
"""

import copy
import json

import pytest

from tests.regression.__main__ import FILE, compared
from tests.regression.cases import CASES, PRESETS, figures

KNOWN = json.loads(FILE.read_text())


@pytest.mark.parametrize("case", CASES)
def test_no_figure_gets_worse(case, request):
    data = None if CASES[case].recording is None else request.getfixturevalue("test_data")
    worse = [line for line in compared(KNOWN, case, figures(CASES[case], data)) if line.endswith("worse")]
    assert not worse, "\n".join(
        [*worse, "if this is meant: .venv/bin/python -m tests.regression --update, and say so in the commit"]
    )


def test_a_figure_that_gets_worse_is_told():
    """Each figure of each preset is made worse by 1 % more than is allowed, one at a time, and must be reported."""
    for case in CASES:
        for preset in PRESETS:
            assert KNOWN["figures"][case][preset], "every case has figures"
            found = copy.deepcopy(KNOWN["figures"][case])
            assert compared(KNOWN, case, found) == []
            found[preset]["mpjpe_mm"] += max(1.01 * KNOWN["noise"][case][preset]["mpjpe_mm"], 0.202)
            (line,) = compared(KNOWN, case, found)
            assert line.startswith(f"{case} {preset} mpjpe_mm") and line.endswith("worse")
