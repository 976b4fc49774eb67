"""Poses of a person from ordinary pictures, by BlazePose: `poses.PoseFinder`.

A detector finds the person (`people`), a square turned upright about them is cut out (`region`), and a network finds
33 landmarks in it (`landmarks`). The landmarks say where to cut in the next picture. `bundle` reads the networks'
files, `network` runs them.

BlazePose: V. Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", arXiv 2006.10204, 2020. Input
and output of the networks are those of their published model cards and graphs.
"""
