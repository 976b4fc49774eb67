"""Joint roles by name, in the naming schemes of common rigs."""

import pytest

from studio.engine.model.joints import CANONICAL, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL, OUTPUT_PARENTS, PARENTS
from studio.engine.model.roles import roles_of
from tests.engine.animation.read.skeletons import EXPECTED, RIGS


@pytest.mark.parametrize("rig", RIGS)
def test_common_rigs(rig):
    tree = RIGS[rig]
    names = list(tree)
    parents = [-1 if tree[name] is None else names.index(tree[name]) for name in names]
    roles = dict(zip([name.replace(" ", "_") for name in names], roles_of(names, parents), strict=True))
    for entry in EXPECTED[rig].split():
        name, role = entry.split("=")
        assert roles[name] == role, (name, roles[name])
    known = [role for role in roles.values() if role]
    assert len(set(known)) == len(known) and set(known) <= set(OUTPUT_JOINTS)


@pytest.mark.parametrize(
    "prefix", ["", "mixamorig:", "mixamorig1:", "Character1_", "Anna:mixamorig:", "Group|"]
)
def test_humanik_names_under_any_prefix(prefix):
    assert roles_of([prefix + name for name in OUTPUT_JOINTS], OUTPUT_PARENTS.tolist()) == OUTPUT_JOINTS


def test_canonical_names_and_names_that_are_nothing():
    expected = OUTPUT_OF_CANONICAL | {"spine": "Spine"}  # the lower of two joints between hips and neck
    assert roles_of(CANONICAL, PARENTS.tolist()) == tuple(expected[name] for name in CANONICAL)
    assert roles_of(["", "Cube", "left", "L", "12", "Camera.001"], [-1] * 6) == ("",) * 6
    assert roles_of([], []) == ()
