"""`studio doctor`: checks the install and the takes."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_json, progress_bar, write_result

_TEXT = """\
Check the install and every take in a folder, and recover takes after a crash.

Raw recordings are never changed. Exits 1 if a fault could not be repaired."""

SESSIONS = Path("sessions")


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "doctor", run, _TEXT)
    parser.add_argument(
        "folder", metavar="DIR", nargs="?", type=Path, help="folder of takes, or a take (default sessions)"
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import StudioError
    from studio.take.upkeep.doctor import check_takes
    from studio.take.upkeep.install import check_install

    folder = SESSIONS if args.folder is None else args.folder
    checks = check_install(folder)
    findings = []
    if args.folder is not None or folder.is_dir():  # before the first recording there is no folder to check
        with progress_bar("takes") as progress:
            findings = check_takes(folder, progress=progress)
    result = {
        "install": [
            {"name": c.name, "ok": c.ok, "detail": c.detail, "action": c.action or None} for c in checks
        ],
        "takes": [
            {"path": str(f.path), "problem": f.problem, "action": f.action, "repaired": f.repaired}
            for f in findings
        ],
    }
    write_result(args, result)
    for check in checks:
        print(f"{'ok   ' if check.ok else 'WRONG'} {check.name}: {check.detail}")
        if check.action:
            print(f"      {check.action}")
    for finding in findings:
        print(f"{'mended' if finding.repaired else 'WRONG'} {finding.path}: {finding.problem}")
        print(f"      {finding.action}")
    wrong = sum(not check.ok for check in checks) + sum(not finding.repaired for finding in findings)
    if wrong:
        raise StudioError("doctor.wrong", "{n} of the things above need attention", n=wrong)
    return 0
