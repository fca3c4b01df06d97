"""The verb `freeze-frame`: one moment of StatsBomb 360 as tracking data that `match` reads."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from ..base.errors import InputError, format_count
from ..base.settings.options import parse_path
from .matching import parse_pitch
from .outputs import ProgressReporter, Writer

_EXAMPLES = """examples, the first lists the events:
  %(prog)s 360.json --events events.json
  %(prog)s 360.json --events events.json --event 13:25 --out shot"""


def add_freeze_frame(verbs) -> argparse.ArgumentParser:
    """Add the verb `freeze-frame`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("freeze-frame", help="one moment of StatsBomb 360 as tracking data for match",
                            epilog=_EXAMPLES)
    verb.add_argument("input", type=parse_path, metavar="FRAMES.json", help="the freeze frames of a match")
    verb.add_argument("--events", type=parse_path, required=True, metavar="EVENTS.json", help="the same match's events")
    verb.add_argument("--event", metavar="ID", help="the event's id, or its time MM:SS; default: list all")
    verb.add_argument("--pitch", type=parse_pitch, metavar="LENGTHxWIDTH",
                      help="size of the pitch in metres; default 105x68")
    verb.add_argument("--out", type=parse_path, metavar="FOLDER",
                      help="moment.csv, four seconds with the event in the middle, and the player's labels")
    verb.set_defaults(run=run_freeze_frame)
    return verb


def run_freeze_frame(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `freeze-frame`: list the events with a frame, or write one as tracking data.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.atomic import check_new_folder
    from ..files.freeze_frames import EVENT_TIME, find_freeze_frame, read_freeze_frames, write_still

    if (options.event is None) != (options.out is None):
        raise InputError("--event and --out", "one without the other", "both, or none to list the events")
    if options.pitch is not None and options.event is None:
        raise InputError("--pitch", "without --event", "the event whose moment has this pitch")
    if options.out is not None:
        check_new_folder(options.out)
    frames = read_freeze_frames(options.input, options.events)
    if options.event is None:
        for frame in frames:
            print(f"{frame.id}  {frame.clock}  {frame.kind}, {frame.player} ({frame.team})")
        return
    frame, others = find_freeze_frame(frames, options.event, options.input)
    count = write_still(options.out, frame, options.pitch)
    for other in others:
        reporter.show_note(f"also at {other.clock}: {other.kind} of {other.player or other.team}, {other.id}")
    if not any(role.startswith("actor") for role in frame.roles):
        reporter.show_note("no one of the people is marked as the actor: no player has the event's labels")
    elif not frame.labels:
        reporter.show_note(f"{frame.kind} says no action: the player stands")
    if options.pitch is not None:
        reporter.show_note("use the same --pitch with match")
    print(f"{options.out}: {frame.kind} of {frame.player or frame.team} at {frame.clock}, "
          f"{format_count(count, 'person', 'people')}, the event at {EVENT_TIME:g} s")
