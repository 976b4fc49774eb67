"""Every command parses its options and has help."""

import pytest

from studio.__main__ import COMMANDS, main, make_parser
from studio.commands.common import spread_settings, table
from studio.commands.stage.serve import is_first_run
from tests.commands.program import studio, studio_process

DESIGNED = ("serve", "camera", "simulate", "import", "calibrate", "solve", "evaluate", "study", "export", "bench",
            "doctor")  # fmt: skip

OPTIONS = {
    "serve": ("--host", "--port", "--sessions", "--demo"),
    "certificate": ("--sessions", "--name"),
    "camera": ("--source", "--server", "--name", "--token"),
    "simulate": (
        "--out",
        "--cameras",
        "--sensor",
        "--tracker",
        "--seed",
        "--unit-m",
        "--rig",
        "--no-calibration",
    ),
    "import": ("--out",),
    "calibrate": ("--json",),
    "board": ("--number", "--out"),
    "solve": ("--preset", "--set", "--name", "--as-live", "--no-edits", "--auto", "--json"),
    "evaluate": ("--reference", "--robot", "--solve", "--json", "--report"),
    "study": ("--seeds", "--out", "--cameras", "--votes"),
    "export": (
        "--format",
        "--out",
        "--solve",
        "--performer",
        "--together",
        "--target",
        "--fps",
        "--interpolation",
        "--root-motion",
        "--mesh",
        "--also",
        "--rotation-order",
        "--unit",
        "--key-error-cm",
        "--start",
        "--end",
        "--take-name",
        "--timecode",
        "--smooth-hz",
        "--loop",
        "--foot-lock",
        "--rig",
        "--mapping",
        "--robot",
        "--balance",
    ),
    "robot": ("add", "list", "show", "remove", "play"),
    "rig": ("--mapping", "--save", "--out", "--json"),
    "splice": ("--out", "--solve", "--times", "--blend", "--near", "--json"),
    "edit": ("--json",),
    "rigid": ("--keep-place", "--performer", "--json"),
    "performers": ("--name", "--exchange", "--at", "--undo"),
    "bench": ("--json",),
    "prepare": (),
    "doctor": ("--json",),
    "batch": ("--preset", "--set", "--solve", "--out", "--processes", "--scheduler", "--json"),
    "config": ("--host", "--port", "--sessions", "--log-format", "--json"),
    "picture": ("--out", "--solve", "--times"),
}


def test_the_commands_of_the_design_are_there():
    assert set(DESIGNED) <= set(COMMANDS)
    assert set(OPTIONS) == set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_explains_itself(command, capsys):
    with pytest.raises(SystemExit) as left:
        make_parser().parse_args([command, "--help"])
    assert left.value.code == 0
    text = capsys.readouterr().out
    assert len(text) > 200
    assert [option for option in OPTIONS[command] if option not in text] == []


def test_help_and_version_of_the_program(tmp_path):
    done = studio_process("--help", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert [command for command in COMMANDS if command not in done.stdout] == []
    assert studio("--version", cwd=tmp_path).stdout.startswith("studio ")


@pytest.mark.parametrize(
    "arguments",
    [("dance",), ("solve",), ("solve", "T", "--loud"), ("export", "T", "--format", "doc", "--out", "x"),
     ("serve", "--port", "70000"), ("simulate", "m.bvh", "--out", "t", "--cameras", "9"),
     ("evaluate", "T"), ("bench", "--frames", "5")],
    ids=" ".join,
)  # fmt: skip
def test_wrong_use_exits_2(arguments, tmp_path):
    done = studio(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.strip()


def test_several_settings_after_one_set():
    assert spread_settings(["solve", "T", "--set", "ik=none", "hands=off", "--name", "x"]) == [
        "solve", "T", "--set", "ik=none", "--set", "hands=off", "--name", "x",
    ]  # fmt: skip
    assert spread_settings(["solve", "--set", "ik=none", "T"]) == ["solve", "--set", "ik=none", "T"]
    assert spread_settings(["solve", "--set=ik=none", "T"]) == ["solve", "--set=ik=none", "T"]


def test_columns_are_aligned():
    assert (
        table([["", "a"], ["long name", "1.0"], ["x", "-"]])
        == "             a\nlong name  1.0\nx            -"
    )


def test_first_run_is_before_the_first_take(tmp_path):
    assert is_first_run(tmp_path / "sessions")
    (tmp_path / "day" / "walk").mkdir(parents=True)
    assert is_first_run(tmp_path)
    (tmp_path / "day" / "walk" / "take.json").write_text("{}")
    assert not is_first_run(tmp_path)


def test_options_without_a_command_are_those_of_serve(capsys):
    with pytest.raises(SystemExit) as left:
        main(["--port", "many"])
    assert left.value.code == 2
    assert "studio serve: error: argument --port: 'many' is no port" in capsys.readouterr().err
