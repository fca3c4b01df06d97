"""The verb `throw synthesize`: a throw or kick that hits a target, alone or within a player's motion."""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from .. import __version__
from ..base.errors import InputError, told_time
from ..base.settings.options import add_options
from .outputs import Writer, check_outputs, writer_of
from .progress_reporter import Told


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("synthesize", help="a throw or kick that hits a target")
    verb.add_argument("--target", type=_point, required=True, metavar="X,Y,Z", help="metres, Z up")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh")
    verb.add_argument("--model", type=Path, metavar="W.npz", help="default: the weights that come with the project")
    add_options(verb, "throw")
    place = verb.add_mutually_exclusive_group()
    place.add_argument("--start", type=_place, metavar="X,Y", help="where the hips are in the first frame; default 0,0")
    place.add_argument("--over", type=_place, metavar="X,Y", help="where the hips are at the release")
    place.add_argument("--ball-place", type=_place, metavar="X,Y", help="where the ball lies that is kicked")
    add_options(verb, "throw.ball")
    verb.add_argument("--library", type=Path, metavar="L", help="with --track: run-up and recovery from it")
    verb.add_argument("--track", type=Path, metavar="T.csv", help="the player's track; the throw is on it at --time")
    verb.add_argument("--annotations", type=Path, metavar="A.txt", help="what else the player does on the track")
    add_options(verb, "library", "cache", "unit")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`throw synthesize`: makes it and writes what was asked for."""
    from ..files.tables import write_ball, write_report
    from ..throws.throw import throw_at

    begun = time.perf_counter()
    inputs = (options.model, options.skeleton, options.track, options.annotations)
    check_outputs(options.out, options.ball, options.report, never=inputs)
    write = writer_of(options.out, writers)
    for one, other, why in (("library", "track", "a player's way"), ("track", "library", "a folder of recordings"),
                            ("annotations", "track", "a player's way"),
                            ("track", "time", "the second at which the ball leaves")):  # fmt: skip
        if getattr(options, one) and getattr(options, other) is None:
            raise InputError(f"--{one}", f"without --{other}", why, f"add --{other}")
    model = _model(options)
    player = _Player.of(options, model, told) if options.library else None
    skeleton, form = _skeleton(options, player)
    loaded = time.perf_counter()
    order = _order(options, player)
    thrown = throw_at(model, order, skeleton, told.progress, told.cancelled)
    notes = list(thrown.warnings)
    if player is not None:
        thrown, joined = player.joined(thrown, told)
        notes += joined
    done = time.perf_counter()
    if form is not None and options.out.suffix.lower() == ".bvh":
        from ..files.bvh import bvh

        notes += [f"{options.out}: {note}" for note in bvh.write(options.out, thrown.motion, form)]
    else:
        write(_take(thrown), options.out)
    if options.ball:
        write_ball(options.ball, thrown.path)
    if options.report:
        seconds = {"load": loaded - begun, "throw": done - loaded}
        write_report(options.report, {"version": __version__, "seed": options.seed, **thrown.report(),
                                      "warnings": notes, "seconds": seconds})  # fmt: skip
    told.end()
    for note in notes:
        told.note(note)
    verb = "struck" if thrown.grip is None else "released"
    print(
        f"{options.out}: {len(thrown.motion)} frames, {verb} at {thrown.release_time:.3f} s with {thrown.speed:.1f} "
        f"m/s, {100 * thrown.impact_error:.1f} cm from the target, {100 * thrown.moved:.1f} cm moved"
    )


def _point(text: str, count: int = 3) -> tuple[float, ...]:
    """Numbers with commas between."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(abs(value) < 1e5 for value in values):
        raise argparse.ArgumentTypeError(f"{text!r} is not {'X,Y,Z' if count == 3 else 'X,Y'} in metres")
    return values


def _place(text: str) -> tuple[float, ...]:
    return _point(text, 2)


def _model(options):
    """The model asked for; without one that of the limb's action which comes with the project."""
    if options.model is None:
        from ..throws.network_npz import shipped_model

        kicks = options.ball_place is not None or (options.limb or "").endswith("foot")
        return shipped_model("kick" if kicks else "throw")
    from ..throws.network_npz import read_model

    return read_model(options.model)


def _skeleton(options, player):
    """Whose bones throw, and the form of their file; None for the model's own."""
    if options.skeleton is None:
        return (player.skeleton if player else None), None
    from ..files.bvh import bvh
    from ..motion.humanoid import identify

    clip = bvh.read(options.skeleton, options.unit)
    try:
        identify(clip.motion.skeleton)
    except InputError as error:  # skeletons do not know their files
        raise InputError(options.skeleton, str(error)) from None
    return clip.motion.skeleton, clip.form


def _order(options, player):
    from ..throws.throw_order import Order

    over = options.over
    if player is not None and not (options.start or options.over or options.ball_place):
        over = player.place(options.time)
    fps = options.fps or (player.plan.fps if player else None)
    return Order(
        target=options.target, limb=options.limb, speed=options.speed, ball=options.kind, start=options.start,
        over=over, ball_place=options.ball_place, release_time=options.time, fps=fps, seed=options.seed,
    )


def _take(thrown):
    """The throw as a take, for writers of other forms than BVH."""
    import numpy as np

    from ..annotation import Timeline
    from ..synthesis.take import Take

    count = len(thrown.motion)
    return Take(
        motion=thrown.motion, start_time=thrown.start_time, clips=("throw",), clip=np.zeros(count, int),
        clip_frame=np.arange(count, dtype=float), mirrored=np.zeros(count, bool), words=((),) * count,
        contacts=np.zeros((count, 2), bool), seams=np.zeros(0, int), timeline=Timeline(), keys=(), ball=thrown.path,
        method="throw", seed=0, warnings=thrown.warnings, correction=np.zeros((count, 2)),
        ik_miss=np.zeros((count, 2)),
    )  # fmt: skip


class _Player:
    """A player on a track, in whose motion the throw is one moment."""

    def __init__(self, library, plan, action: str, at: float):
        self.library, self.plan, self.action, self.at = library, plan, action, at

    @classmethod
    def of(cls, options, model, told: Told) -> _Player:
        """Library, track and annotations read."""
        from ..annotation import Timeline, read_timeline
        from ..files.tracking.tracking import read_track_csv
        from ..library.build import build
        from ..motion.track import clean
        from ..synthesis.plan import Plan

        track, _ = clean(read_track_csv(options.track))
        if not track.times[0] <= options.time <= track.times[-1]:
            expected = f"{told_time(track.times[0])} to {told_time(track.times[-1])} s, the track"
            raise InputError("--time", f"{told_time(options.time)} s", expected)
        fps = options.fps or 30.0
        timeline = Timeline()
        if options.annotations:
            timeline = read_timeline(options.annotations, fps, float(track.times[0]))
        library = build(
            options.library, cache_dir=options.cache, unit=options.unit, progress=told.progress,
            cancelled=told.cancelled,
        )
        plan = Plan(track=track, timeline=timeline, library=str(options.library), fps=fps, seed=options.seed)
        return cls(library, plan, model.settings.action, options.time)

    @property
    def skeleton(self):
        """The library's."""
        return self.library.skeleton

    def place(self, at: float) -> tuple[float, ...]:
        """(2,) m: where the track is at that second."""
        import numpy as np

        track = self.plan.sampled(self.plan.fps)
        return tuple(float(np.interp(at, track.times, column)) for column in track.positions.T)

    def joined(self, thrown, told: Told):
        """The throw within the player's motion, and lines for people."""
        from ..throws.join_throw import join_throw, trim_waiting
        from ..throws.run_up import EDGE, construct_run_up
        from ..throws.throw_order import within

        motion, release = trim_waiting(thrown.motion, thrown.release, EDGE)
        first = round((thrown.release - release) * thrown.motion.fps)
        shift = thrown.shift[first : first + len(motion)]
        thrown = replace(thrown, motion=motion, release=release, shift=shift)
        way = construct_run_up(
            self.library, self.plan, thrown.motion, thrown.release, self.at, action=self.action,
            progress=told.progress, cancelled=told.cancelled,
        )
        laid = join_throw(way.motion, way.start, thrown.motion, thrown.release, at=self.at)
        return within(thrown, laid.motion, laid.start, laid.release, laid.first), [*way.warnings, *laid.warnings]
