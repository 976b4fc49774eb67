"""Robots made for tests: MJCF of humanoids of odd builds, and of what is no humanoid."""

from pathlib import Path

_LIMIT = 'range="-2.2 2.2"'
_AXES = {"roll": "1 0 0", "pitch": "0 1 0", "yaw": "0 0 1"}


def _body(
    name: str, at: str, axes: tuple[str, ...], geom: str, inner: str = "", *, limit: str = _LIMIT
) -> str:
    """A chain of bodies with a hinge each; the last one has the geom and the inner bodies."""
    out, end = "", ""
    for k, axis in enumerate(axes):
        last = k == len(axes) - 1
        place = at if k == 0 else "0 0 0"
        mass = geom if last else '<geom type="sphere" size="0.01" mass="0.05" contype="0" conaffinity="0"/>'
        own = f"{name}_{axis}{k}"
        out += f'<body name="{own}" pos="{place}"><joint name="{own}" axis="{_AXES[axis]}" {limit}/>{mass}'
        end += "</body>"
    return out + inner + end


def _capsule(to: str, radius: float, mass: float) -> str:
    return f'<geom type="capsule" fromto="0 0 0 {to}" size="{radius}" mass="{mass}"/>'


def humanoid(
    *,
    leg: float = 0.2,
    width: float = 0.06,
    trunk: float = 0.25,
    arm: float = 0.13,
    waist: tuple[str, ...] = ("yaw", "pitch", "roll", "pitch", "yaw"),
    ankle: tuple[str, ...] = ("pitch", "roll"),
    t_pose: bool = True,
    feet: bool = True,
    limit: str = _LIMIT,
) -> str:
    """Return the MJCF of a humanoid; lengths in metres: thigh and shank, half the hips' width, trunk, upper arm."""
    limbs = ""
    for side, sign in (("l", 1), ("r", -1)):
        sole = (
            f'<geom type="box" size="{0.35 * leg} {0.16 * leg} 0.01" pos="{0.12 * leg} 0 -0.03" mass="0.2"/>'
        )
        foot = _body(f"{side}_a", f"0 0 {-leg}", ankle, sole, limit=limit) if feet else ""
        shank = _body(f"{side}_k", f"0 0 {-leg}", ("pitch",), _capsule(f"0 0 {-0.8 * leg}", 0.02, 0.5), foot,
                      limit='range="-0.1 2.4"' if limit == _LIMIT else limit)  # fmt: skip
        limbs += _body(
            f"{side}_h",
            f"0 {sign * width} 0",
            ("yaw", "roll", "pitch"),
            _capsule(f"0 0 {-0.8 * leg}", 0.025, 0.8),
            shank,
            limit=limit,
        )
    upper = ""
    for side, sign in (("l", 1), ("r", -1)):
        way = (lambda d, y=sign: f"0 {y * d} 0") if t_pose else (lambda d: f"0 0 {-d}")
        bend = "yaw" if t_pose else "pitch"
        fore = _body(f"{side}_e", way(arm), (bend,), _capsule(way(0.9 * arm), 0.015, 0.2), limit=limit)
        order = ("pitch", "roll", "yaw") if not t_pose else ("pitch", "yaw", "roll")
        bone = _capsule(way(0.8 * arm), 0.018, 0.3)
        upper += _body(f"{side}_s", f"0 {sign * (width + 0.05)} {trunk}", order, bone, fore,
                       limit='range="-3 3"' if limit == _LIMIT else limit)  # fmt: skip
    skull = f'<geom type="sphere" size="0.06" pos="0 0 {trunk + 0.12}" mass="0.6"/>'
    chest = _body(
        "w", "0 0 0.03", waist, _capsule(f"0 0 {0.9 * trunk}", 0.04, 3.0) + skull, upper, limit=limit
    )
    height = 2 * leg + 0.04
    return f"""<mujoco><compiler angle="radian" autolimits="true"/><worldbody><geom type="plane" size="1 1 1"/>
<body name="base" pos="0 0 {height}"><freejoint/><geom type="sphere" size="0.05" mass="2"/>{limbs}{chest}</body>
</worldbody></mujoco>"""


def child() -> str:
    """Return a robot of a child's size with five waist joints, its arms out in the zero pose."""
    return humanoid()


def short_legs() -> str:
    """Return a robot with short legs that have no ankle roll, and no waist pitch."""
    return humanoid(leg=0.14, trunk=0.35, arm=0.2, waist=("yaw",), ankle=("pitch",), t_pose=False)


def quadruped() -> str:
    """Return a robot with four equal legs."""
    legs = "".join(
        _body(f"{x}{y}", f"{x * 0.2} {y * 0.1} 0", ("roll", "pitch"), _capsule("0 0 -0.2", 0.02, 0.3),
              _body(f"{x}{y}_k", "0 0 -0.2", ("pitch",), _capsule("0 0 -0.2", 0.02, 0.3)))
        for x in (-1, 1) for y in (-1, 1)
    )  # fmt: skip
    return f"""<mujoco><worldbody><body name="base" pos="0 0 0.45"><freejoint/>
<geom type="box" size="0.2 0.1 0.05" mass="5"/>{legs}</body></worldbody></mujoco>"""


def arms_alone() -> str:
    """Return a robot on a column, without legs."""
    arms = "".join(
        _body(f"a{y}", f"0 {y * 0.2} 0.5", ("pitch", "roll", "yaw"), _capsule("0 0 -0.2", 0.02, 0.3),
              _body(f"e{y}", "0 0 -0.2", ("pitch",), _capsule("0 0 -0.2", 0.02, 0.3)))
        for y in (-1,)
    )  # fmt: skip
    return f"""<mujoco><worldbody><body name="base" pos="0 0 1"><geom type="box" size="0.1 0.1 0.5" mass="5"/>{arms}
</body></worldbody></mujoco>"""


def urdf(mesh: str = "") -> str:
    """Return a URDF of a humanoid whose first link has joints; `mesh`: of a file that its trunk shows."""
    moments = 'ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"'
    inertial = f'<inertial><mass value="1"/><inertia {moments}/></inertial>'
    shown = f'<visual><geometry><mesh filename="{mesh}"/></geometry></visual>' if mesh else ""
    links, joints = [f'<link name="pelvis">{inertial}{shown}</link>'], []

    def add(name: str, parent: str, at: str, axis: str, geom: str = "") -> str:
        links.append(f'<link name="{name}">{inertial}{geom}</link>')
        joints.append(
            f'<joint name="{name}_joint" type="revolute">'
            f'<parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{at}"/><axis xyz="{_AXES[axis]}"/>'
            '<limit lower="-2" upper="2" velocity="7" effort="50"/></joint>'
        )
        return name

    box = (
        '<collision><origin xyz="0.03 0 -0.04"/><geometry><box size="0.2 0.08 0.02"/></geometry></collision>'
    )
    torso = add("torso", "pelvis", "0 0 0.1", "yaw")
    for side, y in (("left", 0.1), ("right", -0.1)):
        hip = add(
            f"{side}_hip_roll", add(f"{side}_hip_pitch", "pelvis", f"0 {y} 0", "pitch"), "0 0 0", "roll"
        )
        ankle = add(
            f"{side}_ankle_pitch", add(f"{side}_knee", hip, "0 0 -0.35", "pitch"), "0 0 -0.35", "pitch"
        )
        add(f"{side}_ankle_roll", ankle, "0 0 0", "roll", box)
        shoulder = add(f"{side}_shoulder_pitch", torso, f"0 {1.6 * y} 0.4", "pitch")
        upper = add(f"{side}_shoulder_roll", shoulder, "0 0 0", "roll")
        add(f"{side}_wrist", add(f"{side}_elbow", upper, "0 0 -0.25", "pitch"), "0 0 -0.22", "yaw")
    return f'<robot name="made">{"".join(links)}{"".join(joints)}</robot>'


def written(folder: Path, text: str, name: str = "robot.xml") -> Path:
    """Write a model to a file of the folder, and return it."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
