"""Compiled functions work without a place for the cache, and let other threads run."""

import pickle

import numba
import pytest

from studio.engine.base.compiled import compiled


def double(x: float) -> float:
    return 2 * x


def test_a_function_is_compiled():
    assert compiled(double)(2.5) == 5.0


def test_a_cache_that_names_classes_of_an_earlier_version_is_made_anew():
    compiled(double)(2.5)
    kept = compiled(double).dispatcher()._cache._cache_file  # pyright: ignore[reportAttributeAccessIssue]
    with open(kept._index_path, "wb") as file:
        pickle.dump(kept._version, file)
        file.write(b"ctests.engine.base.test_compiled\nGone\n.")
    with pytest.raises(AttributeError):
        kept._load_index()
    assert compiled(double)(2.5) == 5.0
    assert len(kept._load_index()) == 1


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
