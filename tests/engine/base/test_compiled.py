"""Compiled functions work where there is no place to keep them, and let other threads run."""

import numba

from studio.engine.base.compiled import compiled


def double(x: float) -> float:
    return 2 * x


def test_a_function_is_compiled():
    assert compiled(double)(2.5) == 5.0


def test_without_a_cache_folder_it_is_compiled_anew(monkeypatch):
    real, asked = numba.njit, []

    def no_locator(*args, **options):
        asked.append(options.get("cache", False))
        if asked[-1]:
            raise RuntimeError("cannot cache function 'double': no locator available")
        return real(*args, **options)

    monkeypatch.setattr(numba, "njit", no_locator)
    assert compiled(double)(2.5) == 5.0
    assert asked == [True, False]
