"""Switches: every value parses, every other is refused with the allowed ones, JSON keeps them."""

import json
from dataclasses import fields

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import CANONICAL
from studio.engine.model.settings.settings import (
    PRESETS,
    SWITCHES,
    SolveSettings,
    parse_settings,
    preset,
    set_switch,
)
from studio.engine.model.settings.switches import Effector
from tests.engine.switch_values import CHOICES, RANGES
from tests.refused import refused

# Names and values that outside scripts rely on.
DESIGN = {
    "tracker": ("client", "per_camera", "points"),
    "refine_cameras": ("off", "given", "all"),
    "fusion": ("mean", "robust"),
    "ik": ("none", "previous_pose", "combined_skeleton", "kalman_filter"),
    "human_limits": ("on", "off"),
    "displacement_limit": ("none", "before", "after"),
    "smoothing": ("none", "holt:before", "holt:after", "one_euro:before", "one_euro:after"),
    "look_at": ("off", "hands", "far", "near", "point", "measured"),
    "hands": ("off", "circles", "shape"),
    "fingers": ("on", "off"),
    "floor_contact": ("on", "off"),
    "physics": ("on", "off"),
    "finish": ("on", "off"),
    "output_hz": ("30", "60", "120"),
    "bystanders": ("ignored", "performers"),
    "cameras": ("all", "a", "camera_1,camera_2"),
    "confidence_threshold": ("0", "0.75", "1"),
    "flexibility": ("0", "1", "2"),
    "relax_pose": ("0", "0.1", "1"),
    "bone_length_limit": ("off", "2", "0.5"),
    "look_at_point_m": ("0,-2,1.6", "1.5, 0, -3"),
}
NESTED = {
    "displacement_limits_m_s.left_wrist": ("0", "7.5"),
    "effectors.left_wrist.reach": ("0", "0.5", "1"),
    "effectors.hips.pull": ("0", "1"),
    "effectors.right_knee.resist": ("0", "1"),
}
VALUES = [(key, value) for key, values in (DESIGN | NESTED).items() for value in values]


def apply(key, value):
    return set_switch(SolveSettings(), key, value)


def read(solve_settings, key):
    head, *rest = key.split(".")
    value = getattr(solve_settings, head)
    if head == "effectors":
        return getattr(value[rest[0]], rest[1])
    return value[rest[0]] if rest else value


@pytest.mark.parametrize(("key", "value"), VALUES)
def test_every_value_of_the_design_parses(key, value):
    changed = apply(key, value)
    got = read(changed, key)
    if isinstance(got, str):
        assert got == value
    elif isinstance(got, tuple):
        assert got == tuple(float(part) for part in value.split(","))
    else:
        assert got == float(value)
    others = {f.name for f in fields(SolveSettings)} - {key.split(".")[0]}
    assert all(getattr(changed, name) == getattr(SolveSettings(), name) for name in others)


@pytest.mark.parametrize(("key", "value"), VALUES)
def test_json_keeps_every_value(key, value):
    changed = apply(key, value)
    if changed is not None:
        text = json.dumps(changed.to_json(), allow_nan=False)
        assert SolveSettings.from_json(json.loads(text)) == changed


@pytest.mark.parametrize("name", PRESETS)
def test_json_keeps_presets(name):
    assert SolveSettings.from_json(json.loads(json.dumps(preset(name).to_json()))) == preset(name)


@pytest.mark.parametrize(("key", "allowed"), CHOICES.items())
def test_a_value_that_is_not_allowed_lists_those_that_are(key, allowed):
    for value in ("", "perhaps", "," + allowed[0], allowed[0] + " "):
        with refused(SettingsError, "settings.value", key=key, value=value) as error:
            set_switch(SolveSettings(), key, value)
        assert all(each in error.value.values["allowed"] for each in allowed)


@pytest.mark.parametrize("key", RANGES)
@pytest.mark.parametrize("value", ["", "many", "nan", "inf", "-0.01", "2.01", "1e9"])
def test_a_number_out_of_range_names_the_range(key, value):
    low, high = RANGES[key]
    with refused(SettingsError, "settings.value", allowed="settings.between") as error:
        set_switch(SolveSettings(), key, value)
    assert error.value.values["allowed"].values == {"low": low, "high": high}


@pytest.mark.parametrize(
    ("key", "value", "code"),
    [
        ("bone_length_limit", "-1", "settings.between"),
        ("bone_length_limit", "nan", "settings.between"),
        ("bone_length_limit", "on", "settings.between"),
        ("cameras", " ", "settings.camera_names"),
        ("look_at_point_m", "1,2", "settings.point"),
        ("look_at_point_m", "1,2,x", "settings.between"),
        ("look_at_point_m", "1,2,inf", "settings.between"),
        ("effectors.left_wing.reach", "1", "settings.unknown_joint"),
        ("effectors.left_wrist.reach", "1.1", "settings.between"),
        ("effectors.left_wrist.push", "1", "settings.unknown_part"),
        ("effectors.left_wrist", "1", "settings.unknown_part"),
        ("displacement_limits_m_s.tail", "1", "settings.unknown_joint"),
        ("displacement_limits_m_s.hips", "-1", "settings.between"),
        ("displacement_limits_m_s", "1", "settings.by_joint"),
        ("effectors", "1", "settings.by_joint"),
        ("colour", "red", "settings.unknown"),
        ("Fusion", "mean", "settings.unknown"),
        ("fusion.mean", "on", "settings.unknown_part"),
        ("", "1", "settings.unknown"),
        ("__class__", "1", "settings.unknown"),
    ],
)
def test_what_is_refused_says_what_is_allowed(key, value, code):
    with refused(SettingsError, code):
        set_switch(SolveSettings(), key, value)


def test_every_switch_of_the_design_exists_and_is_explained():
    names = {f.name for f in fields(SolveSettings)}
    assert set(DESIGN) | {"effectors", "displacement_limits_m_s", "performers"} == names
    assert list(SWITCHES) == [f.name for f in fields(SolveSettings)]
    for switch in SWITCHES.values():
        assert switch.help[0].isupper() and switch.help.endswith(".") and len(switch.help) > 20
    for key, allowed in CHOICES.items():
        assert set(allowed) == set(DESIGN[key])


def test_the_unchanging_defaults_of_the_studio_preset():
    studio = preset("studio")
    assert (studio.cameras, studio.confidence_threshold, studio.fusion) == ("all", 0.75, "robust")
    assert (studio.human_limits, studio.flexibility, studio.relax_pose) == ("on", 1.0, 0.0)
    assert (studio.floor_contact, studio.hands, studio.output_hz) == ("on", "shape", 60)
    assert studio.ik != "none" and studio.look_at in ("far", "measured")
    assert set(studio.effectors) == set(CANONICAL)


def test_presets_are_those_of_the_design():
    raw, thesis = preset("raw"), preset("thesis")
    assert (raw.fusion, raw.ik, raw.human_limits, raw.look_at, raw.hands) == (
        "mean",
        "none",
        "off",
        "off",
        "off",
    )
    assert (raw.bone_length_limit, raw.smoothing, raw.displacement_limit) == ("off", "none", "none")
    assert (thesis.fusion, thesis.ik, thesis.human_limits) == ("mean", "previous_pose", "on")
    assert thesis.displacement_limit == "after" and thesis.hands == "circles" and thesis.look_at != "off"
    assert thesis.bone_length_limit == "2"
    assert {"raw", "thesis", "studio"} <= set(PRESETS)
    with refused(SettingsError, "settings.unknown_preset", allowed=["raw", "thesis", "studio", "finish"]):
        preset("best")


def test_assignments_apply_in_order_and_need_a_value():
    parsed = parse_settings("raw", ["fusion=robust", " smoothing = one_euro:before ", "fusion=mean"])
    assert parsed.fusion == "mean" and parsed.smoothing == "one_euro:before" and parsed.ik == "none"
    with refused(SettingsError, "settings.not_key_value"):
        parse_settings("raw", ["fusion"])
    assert parse_settings("studio") == preset("studio")


def test_presets_and_settings_are_not_changed_by_others():
    parse_settings("studio", ["effectors.head.reach=0.1", "displacement_limits_m_s.head=3"])
    assert preset("studio").effectors["head"] == Effector()
    assert preset("studio").displacement_limits_m_s == {}
    value = preset("studio").to_json()
    value["effectors"]["head"]["reach"] = 0.0
    assert preset("studio").effectors["head"].reach == 1.0


def test_cameras_are_picked_in_the_takes_order():
    available = ("camera_0", "camera_1", "camera_2")
    assert SolveSettings().camera_names(available) == available
    assert SolveSettings(cameras="camera_2, camera_0").camera_names(available) == ("camera_0", "camera_2")
    for named, told in (("camera_7", "camera_7"), (",", "named"), ("all,camera_0", "all")):
        with refused(SettingsError, "settings.unknown_cameras", names=told, allowed=[*available]):
            SolveSettings(cameras=named).camera_names(available)


def test_derived_values():
    assert SolveSettings().smoothing_filter is None
    assert SolveSettings(smoothing="holt:after").smoothing_filter == ("holt", "after")
    assert SolveSettings(bone_length_limit="off").bone_length_tolerance is None
    assert SolveSettings(bone_length_limit="2").bone_length_tolerance == pytest.approx(0.02)


@settings(deadline=None, max_examples=150)
@given(st.one_of(st.text(), st.sampled_from([*DESIGN, *NESTED])), st.text())
def test_any_text_gives_settings_or_a_settings_error(key, value):
    try:
        changed = set_switch(SolveSettings(), key, value)
    except SettingsError:
        return
    assert SolveSettings.from_json(json.loads(json.dumps(changed.to_json()))) == changed
