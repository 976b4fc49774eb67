"""Placement of cones and limbs in the working frame."""

import numpy as np

from studio.engine.base.compiled import compiled


@compiled
def place_cones(surface, places, rotations):
    """Return origins (cone_count, 3) and frames (cone_count, 3, 3) of the cones in the working frame."""
    count = len(surface.body)
    origins = np.empty((count, 3))
    frames = np.empty((count, 3, 3))
    for c in range(count):
        b = surface.body[c]
        for i in range(3):
            x = places[b, i]
            for j in range(3):
                x += rotations[b, i, j] * surface.origin[c, j]
                y = 0.0
                for k in range(3):
                    y += rotations[b, i, k] * surface.frame[c, k, j]
                frames[c, i, j] = y
            origins[c, i] = x
    return origins, frames


@compiled
def place_limb(chain, offsets, places, rotations, angles, bodies, surface, cones):
    """Return the limb's cones for every candidate: origins (candidate_count, limb_cone_count, 3) and frames."""
    origins = np.empty((len(angles), len(cones), 3))
    frames = np.empty((len(angles), len(cones), 3, 3))
    places, rotations = places.copy(), rotations.copy()
    turned = np.empty((3, 3))
    for k in range(len(angles)):
        for b in bodies:
            parent = chain.parents[b]
            for i in range(3):
                places[b, i] = places[parent, i]
                for j in range(3):
                    places[b, i] += rotations[parent, i, j] * offsets[b, j]
                    rotations[b, i, j] = rotations[parent, i, j]
            for h in range(chain.first[b], chain.first[b + 1]):
                x, y, z = chain.axes[h]
                angle = angles[k, chain.dofs[h]]
                s, c = np.sin(angle), np.cos(angle)
                d = 1.0 - c
                for i in range(3):
                    p, q, r = rotations[b, i, 0], rotations[b, i, 1], rotations[b, i, 2]
                    turned[i, 0] = p * (c + x * x * d) + q * (y * x * d + z * s) + r * (z * x * d - y * s)
                    turned[i, 1] = p * (x * y * d - z * s) + q * (c + y * y * d) + r * (z * y * d + x * s)
                    turned[i, 2] = p * (x * z * d + y * s) + q * (y * z * d - x * s) + r * (c + z * z * d)
                rotations[b] = turned
        for n in range(len(cones)):
            b = surface.body[cones[n]]
            for i in range(3):
                x = places[b, i]
                for j in range(3):
                    x += rotations[b, i, j] * surface.origin[cones[n], j]
                    y = 0.0
                    for m in range(3):
                        y += rotations[b, i, m] * surface.frame[cones[n], m, j]
                    frames[k, n, i, j] = y
                origins[k, n, i] = x
    return origins, frames
