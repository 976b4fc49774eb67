"""`studio edit`: what the operator says of a take, as evidence for its solves."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, add_take, figure, table, write_result

if TYPE_CHECKING:
    from studio.engine.edits.edit import Edit
    from studio.take.edits.kept import TakeEdits
    from studio.take.folder.take import Take

_TEXT = """\
Show and change the edits of a take: what was so, as evidence for its solves.

Edits are kept with the take and honoured by every further `studio solve`, which this does not start; raw frames do
not change. Times are stage times, as in poses.npz; in a live take they count from the first frame.

  studio edit TAKE                                      lists them
  studio edit TAKE add pin joint=left_wrist at=4.2 place_m=0.31,-0.2,1.1 radius_m=0.02
  studio edit TAKE add contact joint=left_ankle start_s=2 end_s=3.5
  studio edit TAKE add leave_out camera=camera_1 start_s=2 end_s=3.5
  studio edit TAKE set e1 radius_m=0.05 note="behind the back"
  studio edit TAKE off e1
  studio edit TAKE undo

docs/edits.md lists the kinds and their keys."""

ACTIONS = ("list", "add", "set", "remove", "off", "on", "undo", "redo", "replace")


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "edit", run, _TEXT)
    add_take(parser)
    add = parser.add_argument
    add("action", metavar="ACTION", nargs="?", choices=ACTIONS, default="list",
        help="list (default), add KIND KEY=VALUE ..., set ID KEY=VALUE ..., remove, off or on ID ..., undo, redo, or "
        "replace FILE: all edits by those in a file that --json wrote")  # fmt: skip
    add("words", metavar="WORD", nargs="*", help="a kind, ids, a file, KEY=VALUE")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    import msgspec

    from studio.take.edits.carry import carried
    from studio.take.edits.kept import read_edits
    from studio.take.folder.take import Take

    take = Take.open(args.take)
    before, says = carried(take, read_edits(take))
    kept = before if args.action == "list" else _changed(take, args.action, args.words, before)
    value = {
        "revision": kept.revision,
        "calibration": kept.calibration,
        "edits": msgspec.to_builtins(kept.edits),
        "can_undo": bool(kept.undo),
        "can_redo": bool(kept.redo),
    }
    write_result(args, value)
    _print(kept)
    if says and args.action == "list":
        print(says)
    new = [one.id for one in kept.edits if one.id not in before.by_id()]
    if new:
        print(f"new: {' '.join(new)}")
    if kept.revision != before.revision:
        print(f"run `studio solve {take.path}` to have it in a solve")
    return 0


def _changed(take: "Take", action: str, words: list[str], kept: "TakeEdits") -> "TakeEdits":
    """Do one action; return the list after it.

    Raises:
        SettingsError: words that do not fit the action.
        TakeError: see `change_edits`.
    """
    import msgspec

    from studio.engine.base.errors import SettingsError
    from studio.take.edits.change import change_edits, no_such_edit, redo_edits, undo_edits

    def known(id_: str) -> "Edit":
        if id_ not in kept.by_id():
            raise no_such_edit(id_, kept.edits)
        return kept.by_id()[id_]

    if action in ("undo", "redo") and not words:
        return undo_edits(take) if action == "undo" else redo_edits(take)
    if action == "add" and words:
        return change_edits(take, [_edit(take, {"id": "", "kind": words[0]}, words[1:])])
    if action == "set" and len(words) > 1:
        before = msgspec.to_builtins(known(words[0]))
        return change_edits(take, [_edit(take, before, words[1:])], revision=kept.revision)
    if action == "remove" and words:
        return change_edits(take, remove=words)
    if action in ("on", "off") and words:
        on = action == "on"
        switched = [msgspec.structs.replace(known(id_), on=on) for id_ in words]
        return change_edits(take, switched, revision=kept.revision)
    if action == "replace" and len(words) == 1:
        edits = _from_file(Path(words[0]))
        gone = [one.id for one in kept.edits if one.id not in {new.id for new in edits}]
        return change_edits(take, edits, gone, revision=kept.revision)
    raise SettingsError(
        "edits.words", "{action} {words} is not allowed; see `studio edit --help`",
        action=action, words=" ".join(words),
    )  # fmt: skip


def _edit(take: "Take", before: dict[str, Any], words: list[str]) -> "Edit":
    """Return an edit with some keys changed, as `KEY=VALUE` says.

    Raises:
        SettingsError: no `KEY=VALUE`.
        TakeError: no edit.
    """
    import msgspec

    from studio.engine.base.errors import SettingsError
    from studio.review.render.strip import stage_time
    from studio.take.edits.check import solved_span
    from studio.take.edits.kept import edit_from_json

    value = dict(before)
    for word in words:
        key, equals, text = word.partition("=")
        if not equals:
            raise SettingsError(
                "edits.key_value",
                "{word!r} is not allowed; write KEY=VALUE, such as joint=left_wrist",
                word=word,
            )
        if key == "at":
            value["start_s"] = value["end_s"] = text
        elif key in ("place_m", "direction", "rotation_deg", "move_m", "joints"):
            value[key] = [part.strip() for part in text.split(",") if part.strip()]
        else:
            value[key] = None if text == "" and key in ("camera", "other") else text
    value.setdefault("end_s", value.get("start_s"))
    edit = edit_from_json(value, texts=True)
    begins_s, _ = solved_span(take) or (0.0, 0.0)
    start_s, end_s = (stage_time(begins_s, one) for one in (edit.start_s, edit.end_s))
    return msgspec.structs.replace(edit, start_s=start_s, end_s=end_s)


def _from_file(file: Path) -> "list[Edit]":
    """Return the edits in a file of `--json`, or in an `edits.json`.

    Raises:
        FormatError: it cannot be read.
        TakeError: something in it is no edit.
    """
    import json

    from studio.engine.base.errors import FormatError
    from studio.take.edits.kept import edit_from_json

    try:
        value = json.loads(file.read_text(encoding="utf-8"))
        edits = value["edits"] if isinstance(value, dict) else value
    except (OSError, ValueError, KeyError, RecursionError) as error:
        raise FormatError(
            "edits.file", "{file} is no file of edits ({error}); `studio edit TAKE --json FILE` writes one",
            file=file, error=error,
        ) from error  # fmt: skip
    return [edit_from_json(one) for one in edits]


def _print(kept: "TakeEdits") -> None:
    if not kept.edits:
        print("no edits")
        return
    rows = [["id", "kind", "on", "from s", "to s", "what", "note"]]
    rows += [
        [one.id, kind_of(one), "on" if one.on else "off", figure(one.start_s, 2), figure(one.end_s, 2),
         words_of(one), one.note]
        for one in kept.edits
    ]  # fmt: skip
    print(table(rows))


def kind_of(edit: "Edit") -> str:
    """Return the name of an edit's kind, as in `edits.json`."""
    return str(edit.__struct_config__.tag)


def words_of(edit: "Edit") -> str:
    """Return a summary of an edit: its keys that are set, without those that all kinds have."""
    import msgspec

    common = {"kind", "id", "start_s", "end_s", "ease_s", "on", "note"}
    values = {
        key: value
        for key, value in msgspec.to_builtins(edit).items()
        if key not in common and value not in (None, [], ()) and (key, value) != ("performer", "performer_1")
    }
    return " ".join(f"{key}={_text(value)}" for key, value in values.items())


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ",".join(map(_text, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
