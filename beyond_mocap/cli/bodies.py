"""The verb `bodies`: the motion of all people of skeletal tracking."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from ..base.errors import InputError, format_count
from ..base.settings.options import add_options, parse_path
from ..files.atomic import atomic_folder, check_new_folder
from ..files.file_names import choose_file_name
from .library import check_library_options, open_library
from .outputs import ProgressReporter, Writer


def add_bodies(verbs) -> argparse.ArgumentParser:
    """Add the verb `bodies`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("bodies", help="the motion of all people of skeletal tracking",
                            epilog="example:\n  %(prog)s --joints skeletal.jsonl --out bodies")
    verb.add_argument("--joints", type=parse_path, required=True, metavar="FILE",
                      help="skeletal tracking: Common Data Format, Hawk-Eye, CSV or .npz")
    verb.add_argument("--out", type=parse_path, required=True, metavar="FOLDER",
                      help="a BVH file for each person and stretch, and report.json")
    verb.add_argument("--library", type=parse_path,
                      help="a folder of clips: how people move where the cameras see nothing of a person")
    add_options(verb, "library")
    verb.set_defaults(run=run_bodies)
    return verb


def run_bodies(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `bodies`: fit a body to each person's joints.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.bvh.bvh import write_bvh
    from ..files.joints.joint_readers import read_joints
    from ..files.tables import write_report
    from ..skeletal.joint_examples import read_examples
    from ..skeletal.reconstruct_bodies import KnownElsewhere, reconstruct_bodies

    check_new_folder(options.out)
    check_library_options(options, "cache", "skeleton", "unit")
    feed = read_joints(options.joints)
    examples = read_examples(open_library(options, reporter)) if options.library else None
    bodies, notes = reconstruct_bodies(feed, reporter.show_progress, reporter.is_cancelled,
                                       known=KnownElsewhere(examples=examples))
    if not bodies:
        raise InputError(options.joints, "; ".join(["no stretch of a body", *notes[:3]]), "half a second of joints",
                         "export more frames or joints")
    rows: list[dict] = []
    used: set[str] = set()
    with atomic_folder(options.out) as folder:
        for body in bodies:
            name = choose_file_name(body.id, used)
            write_bvh(folder / f"{name}.bvh", body.motion)
            rows.append({"file": f"{name}.bvh", "id": body.id, "team": body.team, "start_s": body.start,
                         **body.measure()})
        write_report(folder / "report.json", {"fps": feed.fps, "notes": [*feed.notes, *notes], "bodies": rows})
    reporter.finish([*(f"{options.joints}: {note}" for note in feed.notes), *notes])
    error = sum(row["joint_error_m"]["mean"] * row["frames"] for row in rows) / sum(row["frames"] for row in rows)
    print(f"{options.out}: {format_count(len(rows), 'body', 'bodies')}, joints {100 * error:.1f} cm from the seen ones "
          "on average")
