"""Pictures of solved poses.

`figure` draws the mannequin in one pose with numpy alone (no graphics card), with triangles rasterised by
`raster`; `strip` combines frames of several solves into one picture, `thumbnail` shows one frame of a take.
"""

from studio.review.render.strip import render_strip

__all__ = ["render_strip"]
