"""The verb `match`: many players and the ball, from a provider's files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..base.errors import BeyondMocapError, InputError
from ..base.settings.options import add_options, option_values
from .outputs import Writer, check_outputs, named_folder
from .progress_reporter import Told


def add(verbs):
    """The verb's parser."""
    from ..files.events.event_providers import EVENT_PROVIDERS
    from ..files.tracking.providers import PROVIDERS

    verb = verbs.add_parser("match", help="everybody's motion and the ball of a tracked match, resumable")
    verb.add_argument("--tracking", type=Path, required=True, metavar="FILE", help="a provider's tracking")
    verb.add_argument("--meta", type=Path, metavar="FILE", help="the provider's metadata; default: looked for beside")
    verb.add_argument("--events", type=Path, metavar="FILE", help="what happened, from a provider or as CSV")
    verb.add_argument("--events-meta", type=Path, metavar="FILE", help="of the events; default: looked for beside them")
    verb.add_argument("--events-provider", metavar="NAME", default="",
                      help=f"whose form the events have: {', '.join(EVENT_PROVIDERS)}; default: guessed")
    verb.add_argument("--provider", metavar="NAME", default="",
                      help=f"whose form FILE has: {', '.join(PROVIDERS)}; default: guessed")
    verb.add_argument("--library", type=Path, required=True)
    verb.add_argument(
        "--out", type=named_folder, required=True, metavar="FOLDER", help="is made; goes on where it was left"
    )
    add_options(verb, "match.section")
    add_options(verb.add_mutually_exclusive_group(), "match.work")
    add_options(verb, "match")
    verb.add_argument("--nearest", action="store_true", help="go on with the nearest words; the default")
    add_options(verb, "library")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`match`: makes what is not there yet, and tells what came of it."""
    from ..match.make import make_match, result_of
    from ..match.order import MatchOrder

    write = scene_writer(options.scene, writers) if options.scene else None
    order = MatchOrder(
        tracking=options.tracking, library=options.library, out=options.out, meta=options.meta, events=options.events,
        events_meta=options.events_meta, events_provider=options.events_provider, provider=options.provider,
        **{**option_values(MatchOrder, options, "match.section", "match.work", "match", "library"),
           "players": tuple(dict.fromkeys(options.players)), "workers": options.workers or len(_cores())},
    )  # fmt: skip
    if options.apart is None:
        made = make_match(order, told.progress, told.cancelled)
    else:
        options.apart(without(options.argv, "--scene"), told.progress, told.cancelled)
        made = result_of(order)
    told.end()
    for line in made.notes:
        told.note(line)
    for player in made.failed:
        told.note(f"player {player.id} was left out: {player.reason}")
    if not made.done:
        raise BeyondMocapError(f"{options.out}: no player could be made; match.json there tells why of each")
    if write is not None:
        for line in write(made, options.scene) or ():
            told.note(line)
    print(f"{options.out}: {len(made.done)} of {len(made.done) + len(made.failed)} players, "
          f"{made.span[1] - made.span[0]:.1f} s")  # fmt: skip


def scene_writer(scene: Path, writers: Mapping[str, Writer]) -> Writer:
    """Who writes a whole match to a file with the suffix of `scene`; InputError where nobody does, or it cannot be."""
    check_outputs(scene)
    if not writers:
        raise InputError("--scene", f"{scene.name}, without Blender", "Blender, which writes scenes",
                         "blender --command beyond_mocap match ...")  # fmt: skip
    if scene.suffix.lower() not in writers:
        raise InputError(scene, f"the ending {scene.suffix!r}", f"one of {', '.join(sorted(writers))}")
    return writers[scene.suffix.lower()]


def without(arguments: Sequence[str], option: str) -> list[str]:
    """A command line without a long option of one value, whichever way it is written: shortened too, as argparse takes
    it."""
    kept, rest = [], iter(arguments)
    for one in rest:
        name, equals, _ = one.partition("=")
        if len(name) > 2 and option.startswith(name):
            next(rest if not equals else iter(()), None)
        else:
            kept.append(one)
    return kept


def _cores() -> range | set[int]:
    """The cores that this process may use."""
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
