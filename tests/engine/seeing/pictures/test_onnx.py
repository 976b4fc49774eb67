"""Custom pose networks: small real ONNX networks whose outputs can be computed by hand."""

import json
import sys
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from PIL import Image

from studio.engine.base.errors import FormatError, NotAvailableError
from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.onnx_poses import DescribedNetwork, PersonBox
from studio.engine.seeing.pictures.poses import PoseFinder
from tests.engine.seeing.pictures.videos import pictures_of
from tests.refused import refused

NAMES = JOINT_SETS["mediapipe"]
WIDTH, HEIGHT = 48, 64
WHOLE = PersonBox(0.5 * WIDTH, 0.5 * HEIGHT, WIDTH, HEIGHT)


def write(
    folder: Path,
    nodes: list,
    outputs: dict[str, list],
    *,
    layout: str = "nchw",
    values: dict | None = None,
    **said,
) -> Path:
    """Write a network and its description; return the description."""
    shape = [1, 3, HEIGHT, WIDTH] if layout == "nchw" else [1, HEIGHT, WIDTH, 3]
    graph = helper.make_graph(
        nodes,
        "pose",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, size) for name, size in outputs.items()],
        [numpy_helper.from_array(value, name) for name, value in (values or {}).items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    onnx.checker.check_model(model)
    onnx.save(model, str(folder / "pose.onnx"))
    path = folder / "pose.json"
    content = {
        "network": "pose.onnx",
        "input": {"width": WIDTH, "height": HEIGHT, "layout": layout, **said.pop("input", {})},
        "joints": {"nose": 0},
        "margin": 1.0,
        **said,
    }
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def brightest(folder: Path, **said) -> Path:
    """A network whose one heatmap is the red channel of the picture: its point is where red is brightest."""
    values = {"begin": np.array([0]), "end": np.array([1]), "axis": np.array([1])}
    node = helper.make_node("Slice", ["image", "begin", "end", "axis"], ["map"])
    usual = {"output": {"kind": "heatmap"}, "input": {"scale": 1 / 255}}
    return write(folder, [node], {"map": [1, 1, HEIGHT, WIDTH]}, values=values, **{**usual, **said})


def spot(x: int, y: int, size: tuple[int, int] = (WIDTH, HEIGHT), colour: tuple[int, int, int] = (200, 0, 0)):
    picture = np.zeros((size[1], size[0], 3), np.uint8)
    picture[y, x] = colour
    return Image.fromarray(picture)


def test_a_heatmap_is_read_where_the_picture_says(tmp_path):
    network = DescribedNetwork(brightest(tmp_path))
    pixels, scores = network.read(spot(30, 41), WHOLE)
    np.testing.assert_allclose(pixels[0], [30.5, 41.5])
    assert scores[0] == pytest.approx(200 / 255) and np.isnan(pixels[1:]).all()


def test_a_person_is_cut_out_and_put_back(tmp_path):
    """The box is widened to the input's shape, and points are in pixels of the whole picture."""
    network = DescribedNetwork(brightest(tmp_path, margin=1.5))
    picture = np.zeros((400, 600, 3), np.uint8)
    picture[200:204, 300:304, 0] = 255
    pixels, _ = network.read(Image.fromarray(picture), PersonBox(310.0, 190.0, 60.0, 160.0))
    np.testing.assert_allclose(pixels[0], [302.0, 202.0], atol=3.0)
    picture[190:214, 290:314, 0] = 255
    whole = DescribedNetwork(brightest(tmp_path, box=False))
    pixels, _ = whole.read(Image.fromarray(picture), PersonBox(0.0, 0.0, 1.0, 1.0))
    np.testing.assert_allclose(pixels[0], [302.0, 202.0], atol=13.0)


def test_colours_are_ordered_and_normalised_as_described(tmp_path):
    blue = brightest(
        tmp_path, input={"colour": "bgr", "scale": 1.0, "mean": [50, 0, 0], "deviation": [300, 1, 1]}
    )
    pixels, scores = DescribedNetwork(blue).read(spot(7, 9, colour=(0, 0, 200)), WHOLE)
    np.testing.assert_allclose(pixels[0], [7.5, 9.5])
    assert scores[0] == pytest.approx(0.5)


def test_simcc_is_read_between_its_bins(tmp_path):
    """Two points, whose rows of bins are constant."""
    across, down = np.zeros((1, 2, 2 * WIDTH), np.float32), np.zeros((1, 2, 2 * HEIGHT), np.float32)
    across[0, 0, 19:22] = 0.5, 0.8, 0.5
    down[0, 0, 39:42] = 0.6, 0.9, 0.9
    across[0, 1, 10], down[0, 1, 11] = 3.0, 0.4
    nodes = [helper.make_node("Constant", [], [name], value=numpy_helper.from_array(value)) for name, value in
             (("across", across), ("down", down))]  # fmt: skip
    path = write(
        tmp_path, nodes, {"across": [1, 2, 2 * WIDTH], "down": [1, 2, 2 * HEIGHT]},
        output={"kind": "simcc", "split": 2.0}, joints={"left_hip": 0, "nose": 1},
    )  # fmt: skip
    pixels, scores = DescribedNetwork(path).read(spot(0, 0), WHOLE)
    hip = NAMES.index("left_hip")
    np.testing.assert_allclose(pixels[hip], [20.5 / 2, 41.0 / 2])
    assert scores[hip] == pytest.approx(0.8) and scores[0] == pytest.approx(0.4)


def test_points_are_read_in_the_order_of_their_columns(tmp_path):
    """As in MoveNet: y, x, score, as shares; the picture has its colours last."""
    points = np.zeros((1, 1, 17, 3), np.float32)
    points[0, 0, :, 0], points[0, 0, :, 1], points[0, 0, :, 2] = 0.25, np.arange(17) / 20, 0.7
    node = helper.make_node("Constant", [], ["points"], value=numpy_helper.from_array(points))
    path = write(
        tmp_path, [node], {"points": [1, 1, 17, 3]}, layout="nhwc", joints="coco_17",
        output={"kind": "points", "unit": "share", "columns": ["y", "x", "score"]},
    )  # fmt: skip
    pixels, scores = DescribedNetwork(path).read(spot(0, 0), WHOLE)
    np.testing.assert_allclose(pixels[NAMES.index("left_shoulder")], [WIDTH * 0.25, HEIGHT * 0.25])
    assert np.isfinite(pixels).all(axis=1).sum() == 17 and scores[0] == pytest.approx(0.7)


def test_a_network_of_others_reads_real_pictures(tmp_path, test_data):
    """Its own points replace the studio's; all other points and the body's orientation stay the studio's."""
    picture = pictures_of(test_data / "rgb" / "pose2sim_single" / "cam04.mp4", count=1)[0]
    own = PoseFinder("full").find(picture)
    found = PoseFinder(brightest(tmp_path)).find(picture)
    assert own is not None and found is not None
    np.testing.assert_allclose(found.pixels[1:], own.pixels[1:])
    np.testing.assert_allclose(found.world_m, own.world_m)
    column, row = found.pixels[0].round().astype(int)
    low, high = own.pixels.min(axis=0), own.pixels.max(axis=0)
    reds = picture[int(low[1]) : int(high[1]), int(low[0]) : int(high[0]), 0]
    around = picture[row - 12 : row + 13, column - 12 : column + 13, 0]
    assert around.max() >= 0.9 * reds.max()


@pytest.mark.parametrize(
    "said",
    [
        {"input": {"width": 0}},
        {"input": {"layout": "chw"}},
        {"input": {"mean": [1, 2]}},
        {"output": {"kind": "magic"}},
        {"output": {"kind": "points", "columns": ["x", "score"]}},
        {"joints": "coco_9"},
        {"joints": {"tail": 0}},
        {"joints": {}},
        {"network": "none.onnx"},
        {"margin": 0},
    ],
)
def test_bad_descriptions_are_refused(tmp_path, said):
    path = brightest(tmp_path)
    content = json.loads(path.read_text())
    for key, value in said.items():
        content[key] = {**content[key], **value} if key in ("input", "output") else value
    path.write_text(json.dumps(content))
    with refused(FormatError, "network.description"):
        DescribedNetwork(path)


def test_what_does_not_fit_its_description_is_refused(tmp_path):
    path = brightest(tmp_path, joints={"nose": 4})
    with refused(FormatError, "network.broken"):
        DescribedNetwork(path)
    path = brightest(tmp_path, output={"kind": "simcc"})
    with refused(FormatError, "network.broken"):
        DescribedNetwork(path)
    brightest(tmp_path)
    (tmp_path / "pose.onnx").write_bytes(b"no network")
    with refused(FormatError, "network.broken"):
        DescribedNetwork(path)
    path.write_text("[]")
    with refused(FormatError, "network.description"):
        DescribedNetwork(path)


def test_without_the_runtime_it_is_said_what_to_install(tmp_path, monkeypatch):
    path = brightest(tmp_path)
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with refused(NotAvailableError, "network.no_runtime"):
        PoseFinder(path)
