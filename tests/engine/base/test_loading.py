"""Code is loaded without the garbage collector."""

import gc

import pytest

from studio.engine.base.loading import loading


@pytest.mark.parametrize("fails", [False, True])
def test_nothing_is_collected_while_code_is_loaded(fails):
    frozen = gc.get_freeze_count()
    try:
        with loading():
            assert not gc.isenabled()
            loaded = [[] for _ in range(1000)]
            if fails:
                raise ImportError
    except ImportError:
        pass
    assert gc.isenabled() and gc.get_freeze_count() >= frozen + len(loaded)


def test_who_collects_nothing_anyway_goes_on_so():
    gc.disable()
    try:
        with loading():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
