"""The engine: everything that computes, with no web, no files of takes and no clock of its own.

Each wing imports only wings below it. From the top:

metrics        figures of a solve, alone or against a reference
robots         humanoid robots that a performer moves
animation      animation files in and out, the mannequin, retargeting (step 12)
whole_take     recorded takes: collecting, finishing, physics (step 11)
solve          one instant, live or replayed: timing, fusion, filters, solve, completion (steps 3 to 9)
identity       which body in a camera's frame is which performer
calibration    cameras, performer and floor from a walk (step 4)
seeing         skeletons from depth images and pictures (step 1)
edits          an operator's statements about a take
model          joints, frames, poses, settings, calibrations, the human body
timecode       timecode and its carriers
base           errors, files, geometry, arrays, compiled code

ARCHITECTURE.md shows the steps of a frame; `solve.pipeline` runs steps 3 to 9.
"""
