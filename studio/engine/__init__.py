"""The engine: everything that computes, with no web, no files of takes and no clock of its own.

Where a frame goes, step by step (the numbers are those of ARCHITECTURE.md):

2. `joints`       maps a device's joints to the canonical ones, once
3. `sync`         maps camera clocks to the stage clock and aligns frames into frame sets
4. `calibration`  finds camera poses, clocks, floor and the performer's proportions
5. `fusion`       makes one skeleton of all cameras'
6. `conditioning` limits and filters before the solve
7. `human`, `solve`  the humanoid and what drives it
8. `completion`   look-at, hands, relax pose, floor contact
9. `conditioning` limits and filters after the solve
10. `pipeline`    runs 3 to 9, live and in replay, and returns a pose

Beside it: `motion` (BVH and authored motions), `metrics` (figures against a reference), `export`
(BVH, FBX), `settings` (every switch and preset), `poses` (a solve's result).
"""
