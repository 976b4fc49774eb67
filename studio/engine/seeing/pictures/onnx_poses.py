"""Third-party pose networks, run by ONNX Runtime."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio.engine.base.errors import FormatError, NotAvailableError
from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.described import PoseDescription, read_description

_LANDMARKS = JOINT_SETS["mediapipe"]
_POINTS = {"simcc": 3, "heatmap": 4}
"""Number of dimensions of the outputs, by kind."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PersonBox:
    """Part of a picture: its middle and its size, in pixels from the picture's upper left corner."""

    x: float
    y: float
    width: float
    height: float


class DescribedNetwork:
    """A third-party pose network; used by one thread at a time.

    Args:
        path: of its description.
        threads: number on which it runs.

    Raises:
        FormatError: the description or the network cannot be used.
        NotAvailableError: ONNX Runtime is not installed.
    """

    def __init__(self, path: Path, threads: int = 1) -> None:
        self.description = read_description(path)
        runtime = _runtime()
        options = runtime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = threads
        options.log_severity_level = 3
        try:
            self._session = runtime.InferenceSession(
                self.description.network.read_bytes(), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # the runtime's own errors have no common class
            raise _broken(self.description, str(error).splitlines()[0]) from error
        inputs = self._session.get_inputs()
        if len(inputs) != 1 or len(inputs[0].shape) != 4:
            raise _broken(self.description, "it has another input than one image")
        self._input = inputs[0].name
        self._type = np.uint8 if inputs[0].type == "tensor(uint8)" else np.float32
        probe = Image.new("RGB", (self.description.width, self.description.height))
        self.read(probe, PersonBox(0.5 * probe.width, 0.5 * probe.height, probe.width, probe.height))

    def read(self, picture: Image.Image, person: PersonBox) -> tuple[Array, Array]:
        """Return a person's landmarks, shape (33, 2), and scores 0..1, shape (33,); NaN = not among its points.

        Args:
            picture: RGB.
            person: the person's box; unused if the network reads whole pictures.

        Raises:
            FormatError: the network's output differs from its description.
        """
        what = self.description
        box = (
            _about(person, what.margin, what)
            if what.box
            else _about(
                PersonBox(0.5 * picture.width, 0.5 * picture.height, picture.width, picture.height), 1.0, what
            )
        )
        outputs = self._run(_cut(picture, box, what.width, what.height))
        points, scores = self._decoded(outputs)
        if max(what.joints.values()) >= len(points):
            raise _broken(
                what, f"it gives {len(points)} points, and joints has number {max(what.joints.values())}"
            )
        pixels, sure = np.full((len(_LANDMARKS), 2), np.nan), np.zeros(len(_LANDMARKS))
        scale = np.array([box.width / what.width, box.height / what.height])
        corner = np.array([box.x - 0.5 * box.width, box.y - 0.5 * box.height])
        for name, k in what.joints.items():
            at = _LANDMARKS.index(name)
            pixels[at], sure[at] = corner + points[k] * scale, np.clip(scores[k], 0.0, 1.0)
        return pixels, sure

    def _run(self, image: NDArray[np.uint8]) -> list[Array]:
        what = self.description
        values = image[..., ::-1] if what.colour == "bgr" else image
        if self._type == np.float32:
            values = (values.astype(np.float32) * what.scale - what.mean) / what.deviation
        values = values.transpose(2, 0, 1) if what.layout == "nchw" else values
        try:
            found = self._session.run(None, {self._input: np.ascontiguousarray(values[None], self._type)})
        except Exception as error:  # as above
            raise _broken(what, str(error).splitlines()[0]) from error
        return [np.asarray(one, np.float64) for one in found]

    def _decoded(self, outputs: list[Array]) -> tuple[Array, Array]:
        """Return points in pixels from the input's upper left corner, shape (count, 2), and their scores."""
        what = self.description
        try:
            if what.kind == "simcc":
                across, down = (one[0] for one in outputs[:2])
                places = [_peaks(one) for one in (across, down)]
                return (
                    np.column_stack([place + 0.5 for place, _ in places]) / what.split,
                    np.minimum(places[0][1], places[1][1]),
                )
            if what.kind == "heatmap":
                return self._from_heatmaps(outputs[0][0])
            rows = outputs[0].reshape(-1, len(what.columns))
            points = rows[:, [what.columns.index(one) for one in ("x", "y")]]
            if what.unit == "share":
                points = points * (what.width, what.height)
            score = rows[:, what.columns.index("score")] if "score" in what.columns else np.ones(len(rows))
            return points, score
        except (ValueError, IndexError) as error:
            shapes = ", ".join(str(one.shape) for one in outputs)
            raise _broken(what, f"its outputs of {shapes} are no {what.kind}") from error

    def _from_heatmaps(self, maps: Array) -> tuple[Array, Array]:
        what = self.description
        count, rows, columns = maps.shape
        flat = maps.reshape(count, -1)
        best = flat.argmax(axis=1)
        row, column = np.divmod(best, columns)
        every = np.arange(count)
        x = column + _tops(maps[every, row], column)
        y = row + _tops(maps[every, :, column], row)
        points = np.column_stack([(x + 0.5) * what.width / columns, (y + 0.5) * what.height / rows])
        return points, flat[every, best]


def _peaks(values: Array) -> tuple[Array, Array]:
    """Return the place of the highest value in each row, between the bins, and the value, shape (count,) each."""
    best = values.argmax(axis=1)
    return best + _tops(values, best), values[np.arange(len(values)), best]


def _tops(values: Array, best: NDArray[np.int64]) -> Array:
    """Return the offset from each row's highest value to the peak of the parabola through three values, -0.5..0.5."""
    every, last = np.arange(len(values)), values.shape[1] - 1
    left, middle, right = (values[every, np.clip(best + step, 0, last)] for step in (-1, 0, 1))
    curve = left - 2 * middle + right
    inside = (best > 0) & (best < last) & (curve < -1e-12)
    return np.where(inside, np.clip(0.5 * (left - right) / np.where(inside, curve, -1.0), -0.5, 0.5), 0.0)


def _about(box: PersonBox, margin: float, what: PoseDescription) -> PersonBox:
    """Return a box enlarged by a margin, with the aspect ratio of the network's input."""
    width, height = max(box.width, 1.0) * margin, max(box.height, 1.0) * margin
    shape = what.width / what.height
    return PersonBox(box.x, box.y, max(width, height * shape), max(height, width / shape))


def _cut(picture: Image.Image, box: PersonBox, width: int, height: int) -> NDArray[np.uint8]:
    """Return part of a picture resized to shape (height, width, 3); black outside the picture."""
    left, top = box.x - 0.5 * box.width, box.y - 0.5 * box.height
    rows = (box.width / width, 0.0, left, 0.0, box.height / height, top)
    cut = picture.transform((width, height), Image.Transform.AFFINE, rows, Image.Resampling.BILINEAR)
    return np.asarray(cut)


def _runtime() -> Any:
    try:
        import onnxruntime
    except (ImportError, OSError) as error:
        raise NotAvailableError(
            "network.no_runtime",
            "pose networks of others need ONNX Runtime, which does not load here ({error}); install it: "
            "pip install 'capture-studio[onnx]', or take --model full",
            error=error,
        ) from error
    return onnxruntime


def _broken(what: PoseDescription, error: str) -> FormatError:
    return FormatError(
        "network.broken",
        "{path} cannot be used as it is described ({error}); compare it with its description",
        path=what.network,
        error=error,
    )
