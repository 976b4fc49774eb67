"""Parts of a robot's body, found from its tree of joints, and from names where these are clearer.

Legs are the two chains that end lowest, arms the two other chains of at least three joints on one body. Pelvis and
torso are the bodies from which they branch off. Knee and elbow are the hinges that divide a limb most evenly.
"""

from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.robots.body.surface import surface_points

SIDES = ("left", "right")
LIMBS = {"leg": ("hip", "knee", "foot"), "arm": ("shoulder", "elbow", "hand")}
PARTS: tuple[str, ...] = (
    "pelvis", "torso", "head",
    *(f"{side}_{part}" for side in SIDES for limb in LIMBS.values() for part in limb),
)  # fmt: skip
"""Parts of a mapping. Each is a body of the model: a limb's part rotates in that body's joint; the head may be the
torso."""

LEAST_HINGES = 3
"""Minimum number of hinges of a leg or an arm."""

LEAST_SHARE = 0.15
"""Least distance of a knee or elbow from both ends, as a share of the limb."""

SAME_HEIGHT = 0.15
"""Height above the lowest end up to which an end of a chain is a foot, as a share of the robot's height."""

_NAMES = {
    "knee": ("knee", "calf", "shank"), "elbow": ("elbow", "forearm", "lower_arm"), "head": ("head",),
    "hand": ("hand", "palm", "wrist"),
}  # fmt: skip


class Tree:
    """A model's bodies in its zero pose, as a tree."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, self.data)
        self.names = [model.body(k).name for k in range(model.nbody)]
        self.parents = model.body_parentid.tolist()
        self.children: list[list[int]] = [[] for _ in self.names]
        for body in range(2, model.nbody):
            self.children[self.parents[body]].append(body)

    def hinged(self, body: int) -> bool:
        """Whether a hinge turns the body in its parent."""
        first, count = self.model.body_jntadr[body], self.model.body_jntnum[body]
        return bool(count) and self.model.jnt_type[first] == mujoco.mjtJoint.mjJNT_HINGE

    def up(self, body: int) -> list[int]:
        """Return the body and its ancestors, without the world."""
        out = []
        while body > 0:
            out.append(body)
            body = self.parents[body]
        return out

    def below(self, body: int) -> list[int]:
        """Return the body and all its descendants."""
        out = [body]
        for child in self.children[body]:
            out += self.below(child)
        return out

    def anchor(self, body: int) -> NDArray[np.float64]:
        """Return the position of the body's last joint, or its origin [m], shape (3,)."""
        count = self.model.body_jntnum[body]
        if not self.hinged(body):
            return self.data.xpos[body]
        return self.data.xanchor[self.model.body_jntadr[body] + count - 1]

    def lowest(self, body: int) -> float:
        """Return the height of the lowest point of a body's surface, or of its origin [m]."""
        points = surface_points(self.model, self.data, [body])
        return float(points[:, 2].min()) if len(points) else float(self.data.xpos[body, 2])

    def hinged_up(self, body: int, until: int) -> list[int]:
        """Return the hinged bodies from the body up to `until`, without it, the highest first."""
        chain = self.up(body)
        return [one for one in reversed(chain[: chain.index(until)]) if self.hinged(one)]


def found_parts(path: Path, model: mujoco.MjModel) -> dict[str, str]:
    """Return part -> name of the body.

    Raises:
        FormatError: the robot is no humanoid; the message names what is missing.
    """
    tree = Tree(model)
    legs = _legs(path, tree)
    pelvis = _branch(tree, legs)
    arms, torso = _arms(path, tree, pelvis, legs)
    found = {"pelvis": pelvis, "torso": torso, "head": _head(tree, torso, arms)}
    for limb, ends, root in (("leg", legs, pelvis), ("arm", arms, torso)):
        first, middle, last = LIMBS[limb]
        for side, end in zip(SIDES, ends, strict=True):
            chain = tree.hinged_up(end, root)
            bend = _middle(path, tree, chain, middle, end)
            found[f"{side}_{middle}"] = bend
            found[f"{side}_{first}"] = _first(chain, bend)
            found[f"{side}_{last}"] = end if limb == "leg" else _hand(tree, end, bend)
    return {part: tree.names[found[part]] for part in PARTS}


def _refused(path: Path, missing: str) -> FormatError:
    return FormatError(
        "robot.not_humanoid",
        "{path} is no humanoid: {missing}; name its parts in a mapping, or give another model",
        path=path,
        missing=missing,
    )


def _ends(tree: Tree, bodies: Iterable[int]) -> list[int]:
    """The hinged bodies without hinged descendants."""
    return [body for body in bodies if tree.hinged(body) and not any(map(tree.hinged, tree.below(body)[1:]))]


def _legs(path: Path, tree: Tree) -> tuple[int, int]:
    """The last hinged bodies of the left and the right leg."""
    bodies = range(1, len(tree.names))
    ends = [end for end in _ends(tree, bodies) if len(tree.hinged_up(end, 1)) >= LEAST_HINGES]
    if not ends:
        raise _refused(path, "no legs")
    lows = {end: min(tree.lowest(body) for body in tree.below(end)) for end in ends}
    floor, top = min(lows.values()), max(tree.lowest(body) for body in bodies)
    feet = [end for end in ends if lows[end] <= floor + SAME_HEIGHT * max(top - floor, 1e-6)]
    if len(feet) > 2:
        raise _refused(path, f"{len(feet)} legs reach the floor, two are allowed")
    if len(feet) < 2:
        raise _refused(path, "no two feet")
    left, right = feet
    if _branch(tree, (left, right)) in (left, right):
        raise _refused(path, "no two feet")
    return _sides(tree, left, right)


def _sides(tree: Tree, one: int, other: int) -> tuple[int, int]:
    """Two limbs, the left one first: by their names, else by the axes of robots (x ahead, y to the left)."""
    for first, second in ((one, other), (other, one)):
        names = " ".join(tree.names[body].lower() for body in tree.up(first) if body not in tree.up(second))
        if "left" in names:
            return first, second
    return (one, other) if tree.anchor(one)[1] > tree.anchor(other)[1] else (other, one)


def _branch(tree: Tree, ends: tuple[int, int]) -> int:
    """The lowest common ancestor of both."""
    above = tree.up(ends[1])
    return next(body for body in tree.up(ends[0]) if body in above)


def _arms(path: Path, tree: Tree, pelvis: int, legs: tuple[int, int]) -> tuple[tuple[int, int], int]:
    """The last hinged bodies of the arms, and the body that carries both. A hand's fingers count as one end."""
    in_legs = {body for leg in legs for body in tree.up(leg)} - set(tree.up(pelvis))
    for body in sorted(tree.below(1), key=lambda body: -len(tree.up(body))):
        limbs = [
            child
            for child in tree.children[body]
            if child not in in_legs and _length(tree, child) >= LEAST_HINGES
        ]
        if len(limbs) == 2:
            left, right = _sides(tree, *limbs)
            return (_trunk_of_limb(tree, left), _trunk_of_limb(tree, right)), body
    raise _refused(path, "no two arms")


def _length(tree: Tree, body: int) -> int:
    """Hinges of the longest chain from the body on."""
    return tree.hinged(body) + max((_length(tree, child) for child in tree.children[body]), default=0)


def _trunk_of_limb(tree: Tree, body: int) -> int:
    """The last hinged body of an arm before it branches into fingers."""
    last = body
    while True:
        inner = [child for child in tree.children[body] if _length(tree, child)]
        if len(inner) != 1:
            return last
        body = inner[0]
        last = body if tree.hinged(body) else last


def _middle(path: Path, tree: Tree, chain: list[int], part: str, end: int) -> int:
    """Knee or elbow: by name, else the hinge that divides the limb most evenly.

    A leg ends at its last hinge, an arm at its farthest point.
    """
    start, tip = tree.anchor(chain[0]), tree.anchor(end)
    if part == "elbow":
        points = surface_points(tree.model, tree.data, tree.below(end))
        far = points if len(points) else tree.data.xipos[end][None]
        tip = far[np.argmax(np.linalg.norm(far - start, axis=1))]

    def even(body: int) -> float:
        at = tree.anchor(body)
        return float(min(np.linalg.norm(at - start), np.linalg.norm(tip - at)))

    best = max(chain[1:], key=even)
    if even(best) < LEAST_SHARE * float(np.linalg.norm(tip - start)):
        raise _refused(path, "no feet below the knees" if part == "knee" else "no elbows")
    named = [body for body in chain[1:] if any(name in tree.names[body].lower() for name in _NAMES[part])]
    return named[0] if named else best


def _first(chain: list[int], bend: int) -> int:
    """The body whose joint is the centre of a hip or shoulder: the middle one above the bend."""
    above = chain[: chain.index(bend)]
    return above[len(above) // 2]


def _hand(tree: Tree, end: int, bend: int) -> int:
    """The hand: by name beyond the elbow, else the end of the arm."""
    chain = tree.up(end)
    inner = chain[: chain.index(bend) + 1]
    named = [
        body for body in reversed(inner) if any(name in tree.names[body].lower() for name in _NAMES["hand"])
    ]
    return named[-1] if named else end


def _head(tree: Tree, torso: int, arms: tuple[int, int]) -> int:
    """The head: by name, else the highest end of a chain on the torso other than the arms, else the torso."""
    limbs = {body for arm in arms for body in tree.up(arm)} - set(tree.up(torso))
    own = [body for body in tree.below(torso)[1:] if not limbs & set(tree.up(body))]
    named = [body for body in own if any(name in tree.names[body].lower() for name in _NAMES["head"])]
    if named:
        return named[-1]
    ends = [body for body in _ends(tree, own) if tree.anchor(body)[2] > tree.data.xpos[torso, 2]]
    return max(ends, key=lambda body: tree.anchor(body)[2], default=torso)
