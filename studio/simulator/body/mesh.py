"""A performer's mesh: skin, hair and loose clothes in the T-pose, with skinning weights."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import INDEX
from studio.simulator.body.bones import ANCHORS, BONE, BONE_COUNT, BONES, body_weights, strongest
from studio.simulator.body.clothes import shirt, trousers
from studio.simulator.body.frame import SIDES, Frame
from studio.simulator.body.hand import BONES_PER_HAND, FINGERS, Hand
from studio.simulator.body.head import hair, head
from studio.simulator.body.performers import Actor
from studio.simulator.body.surface import surface
from studio.simulator.body.trunk import trunk

Array = NDArray[np.float64]
_TRUNK_CELL_M, _HEAD_CELL_M, _HAND_CELL_M, _CLOTH_CELL_M = 0.015, 0.0075, 0.0045, 0.017


@dataclass(frozen=True)
class BodyPart:
    """A closed mesh of the body in the T-pose.

    Attributes:
        name: `trunk`, `head`, `hair`, `left_hand`, `right_hand`, `shirt` or `trousers`.
        vertices_m: shape (V, 3).
        triangles: counter-clockwise seen from outside, shape (T, 3).
        weights: of every bone, shape (V, BONE_COUNT).
        albedo: reflectivity of each vertex at 850 nm, shape (V,).
        looseness_m: largest movement of each vertex relative to the body, 0 for skin, shape (V,).
    """

    name: str
    vertices_m: Array
    triangles: NDArray[np.int64]
    weights: Array
    albedo: Array
    looseness_m: Array


@dataclass(frozen=True)
class BodyMesh:
    """A performer's whole mesh.

    Attributes:
        frame: the body's measures.
        parts: closed meshes that overlap.
        hand: the left hand in hand axes; the right one is its mirror image.
    """

    frame: Frame
    parts: tuple[BodyPart, ...]
    hand: Hand

    @cached_property
    def vertices_m(self) -> NDArray[np.float32]:
        """All vertices in the T-pose, shape (V, 3)."""
        return np.concatenate([part.vertices_m for part in self.parts]).astype(np.float32)

    @cached_property
    def triangles(self) -> NDArray[np.int32]:
        """All triangles, shape (T, 3)."""
        starts = np.cumsum([0, *(len(part.vertices_m) for part in self.parts)])
        return np.concatenate(
            [part.triangles + start for part, start in zip(self.parts, starts, strict=False)]
        ).astype(np.int32)

    @cached_property
    def skin(self) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """The four bones of every vertex and their weights, both shape (V, 4)."""
        return strongest(np.concatenate([part.weights for part in self.parts]))

    @cached_property
    def albedo(self) -> NDArray[np.float32]:
        """Reflectivity of every vertex, shape (V,)."""
        return np.concatenate([part.albedo for part in self.parts]).astype(np.float32)

    @cached_property
    def looseness_m(self) -> NDArray[np.float32]:
        """Largest movement of every vertex relative to the body, shape (V,)."""
        return np.concatenate([part.looseness_m for part in self.parts]).astype(np.float32)

    @cached_property
    def anchors_m(self) -> Array:
        """Centre of rotation of every bone in the T-pose, shape (BONE_COUNT, 3)."""
        body = self.frame.joints_m[[INDEX[name] for name in ANCHORS]]
        hands = [
            self.frame.joint(f"{side}_wrist") + hand_axes(sign) @ self.hand.joints_m[i, k]
            for side, sign in SIDES
            for i in range(len(FINGERS))
            for k in range(3)
        ]
        return np.concatenate([body, np.array(hands)])


def hand_axes(sign: float) -> Array:
    """Return the matrix from hand axes to the stage in the T-pose, for the left (+1) or right (-1) hand."""
    return np.diag([sign, -1.0, 1.0])


def make_body(performer: Actor, offsets_m: Array) -> BodyMesh:
    """Return the mesh of a performer with these T-pose offsets [m], shape (21, 3); see `CanonicalMotion`.

    To make one takes 0.2 s, so the last ones are kept: nobody changes their arrays.
    """
    return _made(performer, np.asarray(offsets_m, dtype=np.float64).tobytes())


@lru_cache(maxsize=4)
def _made(performer: Actor, body: bytes) -> BodyMesh:
    offsets_m = np.frombuffer(body).reshape(-1, 3).copy()
    frame = Frame.of(performer, offsets_m)
    hand = Hand.of(float(np.linalg.norm(frame.joint("left_hand") - frame.joint("left_wrist"))) * performer.hand,
                   performer.finger)  # fmt: skip
    solid = trunk(frame)
    low, high = frame.joints_m.min(axis=0), frame.joints_m.max(axis=0)
    wrist = frame.joint("left_wrist")[0]
    box = (
        np.array([-wrist - 0.05, low[1] - 0.35, -0.02]),
        np.array([wrist + 0.05, high[1] + 0.35, high[2] + 0.08]),
    )
    parts = [_part(frame, "trunk", surface(solid.at, *box, _TRUNK_CELL_M * frame.scale**0.5))]
    parts += [_head(frame), *_hair(frame), *_hands(frame, hand)]
    for name, cloth in (("shirt", shirt(frame, solid)), ("trousers", trousers(frame, solid))):
        mesh = surface(cloth.field, *box, _CLOTH_CELL_M * frame.scale**0.5)
        parts.append(_part(frame, name, mesh, looseness=cloth.looseness(mesh[0])))
    return BodyMesh(frame, tuple(parts), hand)


def _part(
    frame: Frame, name: str, mesh: tuple[Array, NDArray[np.int64]], looseness: Array | None = None
) -> BodyPart:
    vertices, triangles = mesh
    weights = body_weights(frame, vertices)
    shirt_albedo, trouser_albedo, hair_albedo, skin, shoe = frame.performer.albedo
    albedo = np.full(
        len(vertices),
        {"shirt": shirt_albedo, "trousers": trouser_albedo, "hair": hair_albedo}.get(name, skin),
    )
    if name == "trunk":
        albedo[vertices[:, 2] < frame.middle("ankle")[2]] = shoe
    loose = np.zeros(len(vertices)) if looseness is None else looseness
    return BodyPart(name, vertices, triangles, weights, albedo, loose)


def _head(frame: Frame) -> BodyPart:
    base, size = frame.joint("head"), 0.25 * max(frame.scale, 0.6) * frame.performer.head
    low = np.array([-0.7 * size, base[1] - 0.8 * size, frame.joint("neck")[2] - 0.12 * frame.scale])
    high = np.array([0.7 * size, base[1] + 0.8 * size, base[2] + 1.1 * size])
    return _part(frame, "head", surface(head(frame).at, low, high, _HEAD_CELL_M * frame.scale**0.5))


def _hair(frame: Frame) -> list[BodyPart]:
    solid = hair(frame)
    if solid is None:
        return []
    base, size = frame.joint("head"), 0.3 * max(frame.scale, 0.6) * frame.performer.head
    low = base - [0.7 * size, 0.8 * size, 0.5 * size]
    mesh = surface(
        solid.at, low, base + np.array([0.7, 0.9, 1.0]) * size, 1.3 * _HEAD_CELL_M * frame.scale**0.5
    )
    part = _part(frame, "hair", mesh)
    weights = np.zeros_like(part.weights)
    weights[:, BONE["head"]] = 1.0
    return [BodyPart("hair", part.vertices_m, part.triangles, weights, part.albedo, part.looseness_m)]


def _hands(frame: Frame, hand: Hand) -> list[BodyPart]:
    s = hand.scale
    solid = hand.solid()
    low, high = np.array([-0.07, -0.09, -0.08]) * s, np.array([0.24, 0.16, 0.06]) * s
    vertices, triangles = surface(solid.at, low, high, _HAND_CELL_M * s**0.5)
    local = _hand_weights(hand, vertices)
    parts = []
    for i, (side, sign) in enumerate(SIDES):
        placed = frame.joint(f"{side}_wrist") + vertices @ hand_axes(sign).T
        weights = np.zeros((len(vertices), BONE_COUNT))
        fore = 1 - np.clip((vertices[:, 0] / s + 0.018) / 0.03, 0.0, 1.0)
        weights[:, BONE[f"{side}_hand"]] = local[:, 0] * (1 - fore)
        weights[:, BONE[f"{side}_forearm_end"]] = local[:, 0] * fore
        start = len(BONES) + i * BONES_PER_HAND
        weights[:, start : start + BONES_PER_HAND] = local[:, 1:]
        turned = triangles[:, ::-1] if np.linalg.det(hand_axes(sign)) < 0 else triangles
        albedo = np.full(len(vertices), frame.performer.albedo[3])
        parts.append(BodyPart(f"{side}_hand", placed, turned, weights, albedo, np.zeros(len(vertices))))
    return parts


def _hand_weights(hand: Hand, vertices: Array) -> Array:
    """Weights of the palm and the 15 finger bones at points in hand axes, shape (n, 16)."""
    s = hand.scale
    weight = np.zeros((len(vertices), 1 + BONES_PER_HAND))
    away = np.empty((len(vertices), len(FINGERS)))
    along = np.empty_like(away)
    for i in range(len(FINGERS)):
        root, way = hand.joints_m[i, 0], hand.joints_m[i, 3] - hand.joints_m[i, 0]
        way = way / np.linalg.norm(way)
        along[:, i] = (vertices - root) @ way
        reach = np.maximum(along[:, i], -0.004 * s)
        away[:, i] = np.linalg.norm(vertices - root - reach[:, None] * way, axis=-1) - hand.radii_m[i].mean()
    nearest = np.argmin(away, axis=1)
    weight[:, 0] = 1.0
    for i in range(len(FINGERS)):
        mine = nearest == i
        t = along[mine, i]
        knots = np.concatenate(
            [[0.0], np.cumsum(np.linalg.norm(np.diff(hand.joints_m[i], axis=0), axis=-1))]
        )[:3]
        soft = np.array([0.009 if i else 0.014, 0.006, 0.005]) * s
        steps = [np.clip((t - knot + w) / (2 * w), 0.0, 1.0) for knot, w in zip(knots, soft, strict=True)]
        first = steps[0] * np.clip(1.6 - away[mine, i] / (0.008 * s), 0.0, 1.0) if i == 0 else steps[0]
        weight[mine, 0] = 1 - first
        for k in range(3):
            after = steps[k + 1] if k < 2 else 0.0
            before = first if k == 0 else np.minimum(steps[k], first)
            weight[mine, 1 + 3 * i + k] = np.maximum(before - np.minimum(after, first), 0.0)
    return weight / weight.sum(axis=1, keepdims=True)
