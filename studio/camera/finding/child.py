"""The process that looks for devices, or takes a picture.

    python -m studio.camera.finding.child PARENT list KIND...
    python -m studio.camera.finding.child PARENT picture SOURCE

It writes lines of JSON. `list`: `{"kind"}` when it begins a kind, then the same with `devices` and `problem`.
`picture`: `{"png"}` in base64, or `{"problem"}`. A problem is a text, or a sentence with its code.
"""

import base64
import io
import json
import os
import sys
from dataclasses import asdict
from typing import Any, TextIO

from PIL import Image

from studio.camera.sources.registry import SOURCES, parse_source
from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import Said, Sentence
from studio.engine.base.system import lower_priority
from studio.worker.parent import end_with_parent

_NICENESS = 10
_WIDTH = 480
"""Maximum width of a picture [pixels]."""


def look(kind: str) -> dict[str, Any]:
    """Return the devices of a kind as JSON, or why they are unknown."""
    try:
        found = SOURCES[kind].config().find()
    except Exception as error:  # a device's library may raise anything; the other kinds are still searched
        return {"kind": kind, "devices": [], "problem": told(error)}
    devices = [{**asdict(one), "device": _plain(one.device), "needs": _plain(one.needs)} for one in found]
    return {"kind": kind, "devices": devices, "problem": ""}


def picture(source: str) -> dict[str, Any]:
    """Return a camera's picture as JSON, or why there is none."""
    try:
        pixels = parse_source(source).picture()
    except Exception as error:  # as above
        return {"problem": told(error)}
    image, file = Image.fromarray(pixels), io.BytesIO()
    image.thumbnail((_WIDTH, _WIDTH))
    image.save(file, "PNG")
    return {"png": base64.b64encode(file.getvalue()).decode("ascii")}


def told(error: Exception) -> str | Sentence:
    """Return an error's message as JSON."""
    if isinstance(error, StudioError):
        return _plain(error.sentence)
    return str(error) or type(error).__name__


def _plain(text: str) -> str | Sentence:
    return text.to_json() if isinstance(text, Said) else text


def _own_output() -> TextIO:
    """Return the standard output for this program alone; output of device libraries goes to standard error."""
    own = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return own


def main(arguments: list[str]) -> None:
    """Run the command in the arguments."""
    parent, task, *rest = arguments
    end_with_parent(int(parent))
    lower_priority(_NICENESS)
    out = _own_output()
    if task == "picture":
        print(json.dumps(picture(rest[0])), file=out, flush=True)
    for kind in rest if task == "list" else ():
        print(json.dumps({"kind": kind}), file=out, flush=True)
        print(json.dumps(look(kind)), file=out, flush=True)
    out.close()
    os._exit(0)  # a device's library may hang when it ends


if __name__ == "__main__":
    main(sys.argv[1:])
