"""`studio rigid`: rigid bodies and markers of a take, which another system tracked or depth cameras saw."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, add_take, figure, progress_bar, table, write_result

if TYPE_CHECKING:
    from studio.engine.base.errors import SettingsError
    from studio.engine.rigid_bodies.known import KnownBody, TakeBodies
    from studio.engine.rigid_bodies.markers import MarkerTracks
    from studio.take.folder.take import Take

_TEXT = """\
Show and use the rigid bodies of a take: those that another system tracked, and props that depth cameras saw; and the
markers that another system tracked.

  studio rigid TAKE                                          lists them, and how far solves are from them
  studio rigid TAKE set Wand use=prop shape=cylinder:3,60    60 cm long, 3 cm thick
  studio rigid TAKE set Cap use=evidence joint=head          pins the head in further solves, once measured
  studio rigid TAKE set Glove use=reference joint=right_hand
  studio rigid TAKE find Stick shape=cylinder:3,90           finds and follows a prop in the depth images
  studio rigid TAKE find Ball shape=sphere:22 solve=studio at=2.5,0.3,-0.4,1.1
                            beside the performers of this solve; at 2.5 s it is at x, y, z on the stage [m]
  studio rigid TAKE measure [SOLVE]                          how bodies sit on joints, and where their system stands
  studio rigid TAKE measure [SOLVE] --keep-place             the same; where their system stands stays
  studio rigid TAKE reference FILE.csv                       a reference for `studio evaluate`, of their joints
  studio rigid TAKE set Anna:LKneeOut joint=left_knee        this marker sits on the knee
  studio rigid TAKE markers FILE.csv [ASSET]                 all markers (or an asset's), a reference for
                            `studio evaluate` once some are on joints or have Plug-in Gait's names; also FILE.c3d

Shapes are box:X,Y,Z, cylinder:DIAMETER,LENGTH[,AXIS] and sphere:DIAMETER in cm. `studio export --prop NAME` writes
a prop. docs/rigid_bodies.md has more."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "rigid", run, _TEXT)
    add_take(parser)
    add = parser.add_argument
    actions = ("list", "set", "find", "measure", "reference", "markers")
    add("action", metavar="ACTION", nargs="?", choices=actions, default="list",
        help="list (default), set, find, measure, reference or markers")  # fmt: skip
    add("words", metavar="WORD", nargs="*", help="see above")
    add("--keep-place", action="store_true", help="measure: where their system stands is right already")
    add(
        "--performer",
        metavar="NAME",
        default="performer_1",
        help="reference: whose joints (default performer_1)",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    import msgspec

    from studio.library import choose_solve
    from studio.take.folder.take import Take
    from studio.take.rigid_bodies.kept import take_bodies, take_markers
    from studio.take.rigid_bodies.marker_files import name_marker, write_markers
    from studio.take.rigid_bodies.used import measure, name_body

    take = Take.open(args.take)
    known = take_bodies(take)
    if args.action == "set" and args.words and args.words[0] in take_markers(take).names:
        known = name_marker(take, args.words[0], _marker_joint(args.words[1:]))
    elif args.action == "set":
        known = name_body(take, _body(known, args.words))
    elif args.action == "find":
        known = _find(take, args.words)
    elif args.action == "measure":
        solve = choose_solve(take.solve_names(), args.words[0] if args.words else None, str(take.path))
        known = measure(take, solve, place=not args.keep_place)
    elif args.action == "reference":
        if len(args.words) != 1:
            raise _wrong_words(args.words, "one file, such as rigid.csv")
        return _write_reference(take, args.performer, Path(args.words[0]))
    elif args.action == "markers":
        if not 1 <= len(args.words) <= 2:
            raise _wrong_words(args.words, "one file, such as markers.csv, and the name of an asset")
        points = write_markers(take, Path(args.words[0]), *args.words[1:])
        print(f"{args.words[0]}: {', '.join(points.names)}; {len(points.time_s)} samples")
        return 0
    write_result(args, {**msgspec.to_builtins(known), "distances_mm": _print(take, known)})
    return 0


def _print(take: "Take", known: "TakeBodies") -> dict[str, dict[str, dict[str, float]]]:
    """Print the bodies; return the distances of solves' joints from them [mm]."""
    import numpy as np

    from studio.take.rigid_bodies.kept import take_markers, take_tracks
    from studio.take.rigid_bodies.used import distances_mm

    tracks, markers = take_tracks(take).tracks, take_markers(take)
    if len(markers.time_s):
        print(_marker_words(markers, known))
    if not tracks:
        print("this take has no rigid bodies")
        return {}
    rows = [["body", "use", "joint", "shape", "readings", "Hz", "offset cm"]]
    for name, track in tracks.items():
        one, tie = known.named(name), known.ties.get(name)
        hz = 1.0 / np.median(np.diff(track.time_s)) if len(track.time_s) > 1 else None
        shape = "" if one is None or one.shape is None else _shape_words(one.shape)
        offset = "" if tie is None else " ".join(f"{100 * value:.1f}" for value in tie.offset_m)
        said = ["-", ""] if one is None else [one.use, one.joint]
        rows.append([name, *said, shape, str(len(track.time_s)), figure(hz), offset])
    print(table(rows))
    place = known.place
    print(
        f"their system stands at {place.x_m:.3f}, {place.y_m:.3f}, {place.z_m:.3f} m, turned by {place.yaw_deg:.2f} "
        f"degrees; {1e3 * known.later_s:.0f} ms are added to when they came"
    )
    found: dict[str, dict[str, dict[str, float]]] = {}
    rows = [["from its joint", "solve", "median mm", "95 % mm"]]
    for solve in take.solve_names() if known.ties else []:
        for name, apart in distances_mm(take, solve).items():
            if len(apart):
                median, most = (float(np.percentile(apart, share)) for share in (50, 95))
                found.setdefault(solve, {})[name] = {"median": round(median, 2), "p95": round(most, 2)}
                rows.append([name, solve, figure(median), figure(most)])
    if len(rows) > 1:
        print(table(rows))
    if known.calibration is not None and known.calibration != take.meta["calibration"]:
        print("measured under another calibration: nothing is evidence until it is measured again")
    return found


def _marker_words(markers: "MarkerTracks", known: "TakeBodies") -> str:
    """Return a table of the named markers, and a line about all readings."""
    import numpy as np

    seen = np.isfinite(markers.positions_m).all(axis=2).mean(axis=0)
    rows = [["marker", "joint", "seen %"]]
    rows += [
        [name, known.markers.get(name, ""), figure(100 * share)]
        for name, share in zip(markers.names, seen, strict=True)
    ]
    loose = float(np.mean(markers.loose_counts))
    return f"{table(rows)}\n{len(markers.time_s)} readings of markers, with {loose:.1f} without a name each"


def _marker_joint(words: list[str]) -> str:
    """Return the joint of `set MARKER joint=...`.

    Raises:
        SettingsError: other words.
    """
    if len(words) != 1 or not words[0].startswith("joint="):
        raise _wrong_words(
            words, "joint= for a marker; it is a reference, and evidence only as part of a rigid body"
        )
    return words[0].removeprefix("joint=")


def _find(take: "Take", words: list[str]) -> "TakeBodies":
    """Find the prop that `find NAME KEY=VALUE ...` describes; return what is known of the take's bodies.

    Raises:
        SettingsError: words that do not fit.
    """
    from studio.engine.rigid_bodies.known import bad_value
    from studio.library import choose_solve
    from studio.offline.props import find_prop_of
    from studio.take.rigid_bodies.kept import take_bodies

    values = dict(word.split("=", 1) for word in words[1:] if word.startswith(("solve=", "at=")))
    body = _body(take_bodies(take), [one for one in words if not one.startswith(("solve=", "at="))])
    solves = take.solve_names()
    solve = choose_solve(solves, values.get("solve"), str(take.path)) if solves or "solve" in values else None
    start = None
    if "at" in values:
        try:
            time_s, x, y, z = (float(one) for one in values["at"].split(","))
        except ValueError as error:
            raise bad_value("at", values["at"], "SECONDS,X,Y,Z") from error
        start = time_s, (x, y, z)
    with progress_bar("find") as progress:
        found = find_prop_of(take, body, solve=solve, start=start, progress=progress)
    beside = "nobody" if solve is None else f"the performers of {solve}"
    print(
        f"{body.name} was seen in {100 * len(found.time_s) / found.looked:.0f} % of the images, beside {beside}"
    )
    return take_bodies(take)


def _shape_words(shape: Any) -> str:
    axis = f",{shape.axis}" if shape.kind == "cylinder" else ""
    return f"{shape.kind}:{','.join(f'{edge:g}' for edge in shape.size_cm)}{axis}"


def _body(known: "TakeBodies", words: list[str]) -> "KnownBody":
    """Return the body that `set NAME KEY=VALUE ...` describes.

    Raises:
        SettingsError: words that do not fit.
    """
    import msgspec

    from studio.engine.rigid_bodies.known import USES, KnownBody, bad_value, shape_of

    if not words or "=" in words[0]:
        raise _wrong_words(words, "a name, then use=, joint=, performer= and shape=")
    values: dict[str, Any] = msgspec.to_builtins(known.named(words[0]) or KnownBody(words[0]))
    for word in words[1:]:
        key, equals, value = word.partition("=")
        if not equals or key not in ("use", "joint", "performer", "shape"):
            raise _wrong_words([word], "use=, joint=, performer= and shape=")
        values[key] = msgspec.to_builtins(shape_of(value)) if key == "shape" else value
    try:
        return msgspec.convert(values, KnownBody)
    except msgspec.ValidationError as error:
        raise bad_value("use", values["use"], ", ".join(USES)) from error


def _wrong_words(words: list[str], allowed: str) -> "SettingsError":
    from studio.engine.base.errors import SettingsError

    given = " ".join(words) or "nothing"
    return SettingsError(
        "rigid.words", "{given} does not fit; allowed: {allowed}", given=given, allowed=allowed
    )


def _write_reference(take: "Take", performer: str, out: Path) -> int:
    from studio.take.rigid_bodies.used import reference_of

    reference = reference_of(take, performer)
    reference.save_csv(out)
    print(f"{out}: {', '.join(reference.known_joints)}, {len(reference.time_s)} samples")
    return 0
