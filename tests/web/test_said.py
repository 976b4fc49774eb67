"""What the server says to people stands in French too: every sentence of the modules that an operator hears from."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import studio

HERE = Path(studio.__file__).parent
TABLES = sorted((HERE / "web" / "static" / "base" / "said").glob("*.js"))
MODULES = (
    "live/cameras/camera",
    "live/calibration/guards",
    "live/cameras/roster",
    "live/calibration/tpose",
    "live/calibration/calibrator",
    "live/engine",
    "live/recording/recorder",
    "live/recording/takes",
    "live/status",
    "engine/calibration/quality/verdict",
    "engine/calibration/cameras/first",
    "engine/calibration/performer/tpose",
    "engine/calibration/quality/spans",
    "engine/calibration/cameras/time_offset",
    "api/takes/find",
    "api/cameras/local_cameras",
    "take/library/trash",
    "take/library/slate",
    "take/folder/names",
    "engine/animation/clip/kinematics",
    "engine/animation/export/points",
)
RAISING = (
    "engine/model/settings",
    "take/library/query",
    "take/library/presets",
    "take/folder/references",
    "take/library/depth_export",
    "api/takes/references",
    "api/takes/rigs",
    "api/stage/presets",
    "api/takes/compare",
    "api/takes/measure",
    "api/cameras/add_cameras",
    "live/stage",
    "live/calibration/performers",
    "engine/metrics/reference/reference",
    "engine/metrics/reference/markers",
    "engine/metrics/reference/alignment",
    "engine/metrics/reference/placing",
    "engine/metrics/reference/matching",
    "engine/metrics/compare",
    "engine/metrics/reference/target_table",
    "engine/animation/motion/bvh",
    "engine/animation/motion/canonical",
    "engine/animation/retarget/files",
    "engine/animation/retarget/glb",
    "engine/animation/retarget/mapping",
    "engine/animation/retarget/onto",
    "engine/animation/retarget/rig",
    "engine/animation/retarget/rest",
    "engine/animation/retarget/transfer",
    "engine/animation/clip/options",
    "engine/model/poses",
    "web/playback/player",
    "web/playback/clip",
    "camera/sources/recording",
    "take/importers/__init__",
    "take/importers/animation",
    "take/importers/bag_files",
    "take/importers/camera_folders",
    "take/importers/depth_folder",
    "take/importers/joints_csv",
    "take/importers/k4a",
    "take/importers/k4a_mkv",
    "take/importers/kinect",
    "take/importers/kinect_pair",
    "take/importers/kinect_states",
    "take/importers/raw_file",
    "take/importers/recording",
    "take/importers/recording_files",
    "take/importers/ros_bag",
    "take/importers/table",
    "take/library/bundle",
    "take/folder/take",
    "take/folder/new",
    "take/upkeep/recovery",
    "take/raw/reader",
    "take/raw/writer",
    "take/raw/chunks",
    "take/raw/depth",
    "review/blind/model",
    "review/blind/desk",
    "review/blind/store",
    "engine/model/calibration",
    "engine/animation/export/__init__",
    "engine/animation/clip/targets",
    "engine/animation/clip/timecode",
)
"""Of these what they raise: files and settings that do not do. Their other texts are for programs."""

FRAGMENTS = {
    # parts of sentences, joined in the code; names of threads
    "shares USB controller 7 with 7",
    "as is 7 on the same machine",
    "7 min",
    "end of recording",
    "7; plug them into ports of different USB controllers or machines, or lower their frame rates",
    # programming errors and answers that no page asks for
    "poses: 7 joints have no parent; export needs one root",
    "poses: a rotation is a quaternion of no length; solve the take again",
    "poses: the times of the frames do not increase; solve the take again",
    "poses: positions and rotations must be finite",
    "poses: every parent must come before its child",
    "a unit of 7 m: only a BVH takes one; leave it out",
    "speed '7' is not allowed; allowed: 7",
    "source 'recording:7' needs a camera of the recording, as recording:<path>#<camera>; it has 7",
    "7: 7; allowed: 7",
    "'7' leads out of 7; choose a plain name",
    "take='7' is not allowed; allowed: session/name",
}
SAMPLE = "7"


def table() -> dict[str, str]:
    """French by English sentence."""
    found: dict[str, str] = {}
    for path in TABLES:
        body = re.fullmatch(r"export default (\{.*\});\n", path.read_text(encoding="utf-8"), re.DOTALL)
        assert body, f"{path.name} is to be one object of strings"
        for english, french in json.loads(body.group(1), object_pairs_hook=lambda items: items):
            assert english not in found, f"{english} stands twice"
            found[english] = french
    return found


def pattern(english: str) -> re.Pattern[str]:
    """The sentence as an expression, as the page makes it."""
    return re.compile("(.+?)".join(re.escape(part) for part in re.split(r"\{\w+\}", english)), re.DOTALL)


def raised(path: Path) -> Iterator[str]:
    """Texts of three words and more in what a module raises."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise):
            yield from sentences(node)


def sentences(tree: ast.AST) -> Iterator[str]:
    """Texts of three words and more that are no docstrings and no lines of the log, with a sample for each value."""
    left_out: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr):
            left_out.add(id(node.value))
        log = isinstance(node, ast.Call) and ast.unparse(node.func).startswith("_log.")
        if log or isinstance(node, ast.JoinedStr):
            left_out |= {id(part) for part in ast.walk(node) if part is not node}
    for node in ast.walk(tree):
        if id(node) in left_out:
            continue
        if isinstance(node, ast.JoinedStr):
            text = "".join(_text_of(part) for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        else:
            continue
        if len(text.split()) >= 3:
            yield text


def _text_of(part: ast.expr) -> str:
    if isinstance(part, ast.Constant):
        return str(part.value)
    assert isinstance(part, ast.FormattedValue)
    return f"'{SAMPLE}'" if part.conversion == ord("r") else SAMPLE


@pytest.mark.parametrize("module", (*MODULES, *RAISING))
def test_every_sentence_of_the_server_is_known(module: str) -> None:
    patterns = [pattern(english) for english in table()]
    path = HERE / f"{module}.py"
    for text in raised(path) if module in RAISING else sentences(ast.parse(path.read_text(encoding="utf-8"))):
        text = text.replace("7 arm", "left arm").replace("too 7:", "too low:").replace("7 name", "take name")
        known = text in FRAGMENTS or any(one.fullmatch(text) for one in patterns)
        assert known, f"said/*.js has no French for: {text}"


def test_both_languages_have_the_same_values() -> None:
    unshown = {"id", "same", "file"}  # which only programs need
    for english, french in table().items():
        wanted, given = (set(re.findall(r"\{(\w+)\}", text)) for text in (english, french))
        assert given <= wanted and wanted - given <= unshown | {"path"}, english
        assert french.strip(), english
