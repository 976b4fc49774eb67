"""The servers of the API's tests."""

from tests.api.conftest import recorded, start_studio, studio

__all__ = ["recorded", "start_studio", "studio"]
