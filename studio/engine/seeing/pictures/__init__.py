"""Poses of a person from ordinary pictures, by BlazePose: `poses.PoseFinder`.

A detector finds the person (`people`), an upright square around the person is cut out (`region`), and a network finds
33 landmarks in it (`landmarks`). The landmarks give the square of the next picture. `bundle` reads the networks'
files, `network` runs them.

BlazePose: V. Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", arXiv 2006.10204, 2020. Input
and output of the networks are those of their published model cards and graphs.
"""
