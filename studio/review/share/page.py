"""The replay page: one HTML file with the player, the motion and the texts, without any request to a server.

The file enforces this: its Content-Security-Policy allows only its own script and that script's unpacked modules.
"""

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from functools import cache
from typing import Any

from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup

from studio.engine.model.poses import Poses, on_output_joints
from studio.review.share.bake import replay_glb
from studio.review.share.bundle import STATIC, bundle, packed
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take

_ENTRY = STATIC / "vote" / "share_page.js"
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


def replay_page(
    poses: Poses | Sequence[Poses],
    *,
    title: str,
    subtitle: str = "",
    start_s: float | None = None,
    end_s: float | None = None,
) -> bytes:
    """Return a part of a solve as an HTML file.

    Args:
        poses: the solve; for several performers, the poses of each.
        title, subtitle: texts above it.
        start_s, end_s: the part [s from its first frame]; None: all of it.

    Raises:
        FormatError: poses that cannot be exported.
        SettingsError: there is no frame in that part.
    """
    motion = packed(replay_glb(poses, start_s=start_s, end_s=end_s))
    template = _templates().get_template("share.html")
    values = {
        "title": title, "subtitle": subtitle, "modules": Markup(_modules()), "motion": motion,
        "begins": start_s or 0.0,
    }  # fmt: skip
    script = _SCRIPT.search(template.render(policy="", style="", **{**values, "modules": "", "motion": ""}))
    assert script is not None
    style = Markup(
        (STATIC / "vote" / "share.css").read_text(encoding="utf-8")
    )  # the program's own, like the modules
    return template.render(policy=policy(script[1]), style=style, **values).encode()


def solve_page(take: Take, solve: str, *, subtitle: str = "", **how: Any) -> bytes:
    """Return a part of a take's solve as an HTML file, with all performers and their names in the subtitle; arguments
    and errors as `replay_page`."""
    performers = solved_performers(take, solve)
    poses = [on_output_joints(one.poses) for one in performers]
    if len(poses) == 1:
        return replay_page(poses[0], subtitle=subtitle, **how)
    names = ", ".join(one.name for one in performers)
    return replay_page(poses, subtitle=f"{subtitle} · {names}" if subtitle else names, **how)


def policy(script: str) -> str:
    """Return the policy that allows only this inline script and its products."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    return (
        f"default-src 'none'; script-src 'sha256-{digest}' blob:; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


@cache
def _modules() -> str:
    """The player's modules as JSON that is safe in HTML: base64 cannot end a script."""
    return json.dumps([[name, packed(text)] for name, text in bundle(_ENTRY)])


@cache
def _templates() -> Environment:
    return Environment(loader=FileSystemLoader(STATIC.parent / "templates"), autoescape=True)
