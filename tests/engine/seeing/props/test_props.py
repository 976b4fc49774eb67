"""Props that swing in front of two simulated depth cameras are found and followed by their shape."""

import numpy as np
import pytest

from studio.engine.rigid_bodies.known import shape_of
from studio.engine.seeing.props.follow import follow_prop
from studio.engine.seeing.props.solid import distances_m, surface, turns_of
from tests.engine.seeing.props.moving import MovingProp, errors, looks, scene


@pytest.mark.parametrize("text", ["box:10,20,40", "cylinder:4,90", "cylinder:4,90,x", "sphere:22"])
def test_points_of_a_surface_lie_on_it(text):
    shape = shape_of(text)
    places, normals = surface(shape, 200)
    assert np.abs(distances_m(shape, places)).max() < 1e-9
    assert distances_m(shape, places + 0.03 * normals) == pytest.approx(0.03, abs=1e-9)
    assert len(turns_of(shape)) == {"box": 3, "cylinder": 2, "sphere": 0}[shape.kind]
    np.testing.assert_allclose(np.ptp(places, axis=0), shape.edges_m, atol=0.12 * shape.edges_m.max())


@pytest.mark.parametrize(
    ("text", "most_mm", "most_deg"), [("box:15,25,35", 20.0, 5.0), ("sphere:22", 12.0, 180.0)]
)
def test_a_prop_is_found_and_followed(text, most_mm, most_deg):
    prop = MovingProp(text)
    times, cameras, images = scene(prop, 1.0)
    found = follow_prop(times, looks(cameras, images), prop.shape)
    assert found is not None
    away, axis = errors(prop, found)
    assert len(found.time_s) > 0.9 * len(times)
    assert np.median(away) < most_mm and np.median(axis) < most_deg
