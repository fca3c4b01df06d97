"""The verb `match`: many players and the ball, from a provider's files."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from ..errors import BeyondMocapError, InputError
from .numbers import positive, rate, seed, whole
from .outputs import Writer, check_outputs
from .told import Told

MOST_WORKERS = 256


def add(verbs):
    """The verb's parser."""
    from ..files.event_providers import EVENT_PROVIDERS
    from ..files.providers import PROVIDERS

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
    verb.add_argument("--out", type=_named, required=True, metavar="FOLDER", help="is made; goes on where it was left")
    verb.add_argument("--from", dest="start", type=float, metavar="SECONDS", help="of the match's clock, from then on")
    verb.add_argument("--to", dest="end", type=float, metavar="SECONDS", help="up to then")
    verb.add_argument("--players", nargs="+", default=[], metavar="ID", help="only these, by id; default: everybody")
    _add_work(verb)
    _add_results(verb)
    verb.add_argument("--cache", type=Path, metavar="DIR", help="where the library's cache is kept")
    verb.add_argument("--skeleton", type=Path, metavar="CLIP.bvh", help="whose skeleton the library has")
    verb.add_argument("--unit", type=positive, metavar="METRES", help="metres per unit of the BVH files")
    verb.set_defaults(run=run)
    return verb


def _add_work(verb) -> None:
    """Who does it."""
    many = partial(whole, low=1, high=MOST_WORKERS, expected=f"1 to {MOST_WORKERS}")
    who = verb.add_mutually_exclusive_group()
    who.add_argument("--workers", type=many, metavar="N", help="processes on this machine; default: one per core")
    who.add_argument("--scheduler", default="", metavar="ADDRESS", help="of a Dask cluster whose workers do it")


def _add_results(verb) -> None:
    """What comes out, and how."""
    verb.add_argument("--no-solve-touches", action="store_true", help="the ball as the feed has it, and no touches")
    verb.add_argument("--annotations", type=Path, metavar="DIR", help="words of players as DIR/ID.txt, not found ones")
    verb.add_argument("--bvh", action="store_true", help="every player as BVH too")
    verb.add_argument(
        "--scene", type=Path, metavar="FILE",
        help="everybody, ball and pitch in one file; inside Blender: .blend, .fbx, .glb, .usdc",
    )
    verb.add_argument("--no-figures", action="store_true", help="no reports, no provenance, no page")
    verb.add_argument("--fps", type=rate, default=30.0)
    verb.add_argument("--seed", type=seed, default=0)
    verb.add_argument(
        "--exact", dest="nearest", action="store_false",
        help="a player whose words the library lacks fails, instead of going on with the nearest it has",
    )
    verb.add_argument("--nearest", action="store_true", help="go on with the nearest words; the default")


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`match`: makes what is not there yet, and tells what came of it."""
    from ..match.make import make_match, result_of
    from ..match.order import MatchOrder

    write = scene_writer(options.scene, writers) if options.scene else None
    order = MatchOrder(
        tracking=options.tracking, library=options.library, out=options.out, meta=options.meta, events=options.events,
        events_meta=options.events_meta, events_provider=options.events_provider, provider=options.provider,
        cache=options.cache, skeleton=options.skeleton, unit=options.unit, start=options.start, end=options.end,
        players=tuple(dict.fromkeys(options.players)), fps=options.fps,
        seed=options.seed, nearest=options.nearest, solve_touches=not options.no_solve_touches,
        annotations=options.annotations, bvh=options.bvh, figures=not options.no_figures,
        workers=options.workers or len(_cores()), scheduler=options.scheduler,
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


def _named(text: str) -> Path:
    """A folder that has a name: an empty one would be the folder at hand."""
    if not text.strip():
        raise argparse.ArgumentTypeError("no folder is named")
    return Path(text)
