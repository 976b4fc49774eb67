"""Pictures of solved poses, and the mannequin that pictures and the browser view share.

`body` holds the mannequin's parts and places them for one pose, `shapes` their unit meshes, `figure` draws
one figure with numpy alone (no graphics card), `strip` lays frames of several solves out as one picture.
"""

from studio.render.strip import render_strip

__all__ = ["render_strip"]
