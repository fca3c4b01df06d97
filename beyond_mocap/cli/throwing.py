"""The verb `throw`: throws and kicks from trained networks, with the verbs train, synthesize, evaluate and examples."""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import __version__
from ..base.errors import InputError, told_time
from ..base.settings.options import add_options
from .outputs import Told, Writer, add_own_verbs, build_take, check_outputs, naming, writer_of

if TYPE_CHECKING:
    from ..library.library import Library
    from ..synthesis.plan import Plan


def add_throw(verbs):
    """Add the verb `throw`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("throw", help="throws and kicks from networks: train, synthesize, evaluate, examples")
    return add_own_verbs(verb, "throw_verb", *(_add_train, _add_synthesize, _add_evaluate, _add_examples))


def _add_train(verbs):
    verb = verbs.add_parser("train", help="train networks on a folder of BVH and annotations (see make training)")
    verb.add_argument("folder", type=Path, metavar="FOLDER", help="recordings, annotations and optionally throws.csv")
    verb.add_argument("--out", type=Path, required=True, metavar="W.npz", help="the trained model")
    add_options(verb, "throw.train")
    verb.set_defaults(run=run_train)
    return verb


def run_train(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `throw train`: train a model and write it.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    check_outputs(options.out, never=(options.config, options.skeleton))
    if options.out.suffix.lower() != ".npz":
        raise InputError(options.out, "not a weights file", "a name ending in .npz", "choose another file type")
    _require_training()
    from training.train import train_folder

    train_folder(options, told)


def _require_training() -> None:
    """Raise InputError if jax, optax or the project's `training` folder is missing, for example in Blender."""
    core = __name__.partition(".cli.")[0]
    try:
        if core != "beyond_mocap":  # inside Blender the core has another name, but training imports it by this one
            raise ImportError
        import jax  # noqa: F401
        import optax  # noqa: F401

        import training  # noqa: F401
    except ImportError:
        raise InputError(
            "throw train", "this Python cannot train", "jax, optax and the project's folder",
            "in the project's folder run 'make training', then .venv-training/bin/python -m beyond_mocap throw train "
            "...",
        ) from None


def _add_synthesize(verbs):
    verb = verbs.add_parser("synthesize", help="a throw or kick that hits a target")
    verb.add_argument("--target", type=_point, required=True, metavar="X,Y,Z", help="metres, Z up")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh")
    verb.add_argument("--model", type=Path, metavar="W.npz", help="default: the weights supplied with the project")
    add_options(verb, "throw")
    place = verb.add_mutually_exclusive_group()
    place.add_argument("--start", type=_place, metavar="X,Y", help="hips in the first frame; default 0,0")
    place.add_argument("--over", type=_place, metavar="X,Y", help="position of the hips at the release")
    place.add_argument("--ball-place", type=_place, metavar="X,Y", help="position of the ball that is kicked")
    add_options(verb, "throw.ball")
    verb.add_argument("--library", type=Path, metavar="L", help="with --track: source of run-up and recovery")
    verb.add_argument("--track", type=Path, metavar="T.csv", help="the player's track; the throw is on it at --time")
    verb.add_argument("--annotations", type=Path, metavar="A.txt", help="the player's other actions on the track")
    add_options(verb, "library", "cache", "unit")
    verb.set_defaults(run=run_synthesize)
    return verb


def run_synthesize(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `throw synthesize`: synthesize a throw or kick and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.tables import write_ball, write_report
    from ..throws.throw import throw_at

    begun = time.perf_counter()
    inputs = (options.model, options.skeleton, options.track, options.annotations)
    check_outputs(options.out, options.ball, options.report, never=inputs)
    write = writer_of(options.out, writers)
    for one, other, why in (("library", "track", "a player's track"), ("track", "library", "a folder of recordings"),
                            ("annotations", "track", "a player's track"),
                            ("track", "time", "the time of the ball's release")):  # fmt: skip
        if getattr(options, one) and getattr(options, other) is None:
            raise InputError(f"--{one}", f"set without --{other}", why, f"add --{other}")
    model = _read_chosen_model(options)
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
        still = np.zeros((len(thrown.motion), 2))
        write(build_take(thrown.motion, "throw", "throw", start_time=thrown.start_time, ball=thrown.path,
                         warnings=thrown.warnings, correction=still, ik_miss=still), options.out)  # fmt: skip
    if options.ball:
        write_ball(options.ball, thrown.path)
    if options.report:
        seconds = {"load": loaded - begun, "throw": done - loaded}
        write_report(options.report, {"version": __version__, "seed": options.seed, **thrown.report(),
                                      "warnings": notes, "seconds": seconds})  # fmt: skip
    told.end(notes)
    verb = "struck" if thrown.grip is None else "released"
    print(
        f"{options.out}: {len(thrown.motion)} frames, {verb} at {thrown.release_time:.3f} s with {thrown.speed:.1f} "
        f"m/s, {100 * thrown.impact_error:.1f} cm from the target, {100 * thrown.moved:.1f} cm moved"
    )


def _point(text: str, count: int = 3) -> tuple[float, ...]:
    """Parse numbers separated by commas, in metres."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(abs(value) < 1e5 for value in values):
        raise argparse.ArgumentTypeError(f"{text!r} is not {'X,Y,Z' if count == 3 else 'X,Y'} in metres")
    return values


def _place(text: str) -> tuple[float, ...]:
    return _point(text, 2)


def _read_chosen_model(options):
    """Read the model of the command line; without one, the supplied model for the limb's action."""
    if options.model is None:
        from ..throws.network_npz import shipped_model

        kicks = options.ball_place is not None or (options.limb or "").endswith("foot")
        return shipped_model("kick" if kicks else "throw")
    from ..throws.network_npz import read_model

    return read_model(options.model)


def _skeleton(options, player):
    """Read the skeleton and the form of its file; (None, None) for the model's own."""
    if options.skeleton is None:
        return (player.library.skeleton if player else None), None
    from ..files.bvh import bvh
    from ..motion.humanoid import identify

    clip = bvh.read(options.skeleton, options.unit)
    with naming(options.skeleton):
        identify(clip.motion.skeleton)
    return clip.motion.skeleton, clip.form


def _order(options, player):
    """Build the request of the throw from the command line."""
    from ..throws.throw import Order

    over = options.over
    if player is not None and not (options.start or options.over or options.ball_place):
        over = player.place(options.time)
    fps = options.fps or (player.plan.fps if player else None)
    return Order(
        target=options.target, limb=options.limb, speed=options.speed, ball=options.kind, start=options.start,
        over=over, ball_place=options.ball_place, release_time=options.time, fps=fps, seed=options.seed,
    )


@dataclass(frozen=True, eq=False)
class _Player:
    """A player on a track whose motion includes the throw.

    Attributes:
        library: the library for run-up and recovery.
        plan: track, annotations and settings.
        action: "throw" or "kick".
        time: seconds on the track's clock at which the ball leaves.
    """

    library: Library
    plan: Plan
    action: str
    at: float

    @classmethod
    def of(cls, options, model, told: Told) -> _Player:
        """Read library, track and annotations of the command line."""
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
        library = build(options.library, cache_dir=options.cache, unit=options.unit, progress=told.progress,
                        cancelled=told.cancelled)
        plan = Plan(track=track, timeline=timeline, library=str(options.library), fps=fps, seed=options.seed)
        return cls(library, plan, model.settings.action, options.time)

    def place(self, at: float) -> tuple[float, ...]:
        """Find the track's position (2,) m at a time."""
        track = self.plan.sampled(self.plan.fps)
        return tuple(float(np.interp(at, track.times, column)) for column in track.positions.T)

    def joined(self, thrown, told: Told):
        """Insert the throw into the player's motion; return it with lines for the user."""
        from ..throws.join_throw import join_throw, trim_waiting
        from ..throws.run_up import EDGE, construct_run_up
        from ..throws.throw_order import within

        motion, release = trim_waiting(thrown.motion, thrown.release, EDGE)
        first = round((thrown.release - release) * thrown.motion.fps)
        shift = thrown.shift[first : first + len(motion)]
        thrown = replace(thrown, motion=motion, release=release, shift=shift)
        way = construct_run_up(self.library, self.plan, thrown.motion, thrown.release, self.at, action=self.action,
                               progress=told.progress, cancelled=told.cancelled)
        laid = join_throw(way.motion, way.start, thrown.motion, thrown.release, at=self.at)
        return within(thrown, laid.motion, laid.start, laid.release, laid.first), [*way.warnings, *laid.warnings]


def _add_evaluate(verbs):
    verb = verbs.add_parser("evaluate", help="measure trained networks on recorded throws or kicks")
    verb.add_argument("--model", type=Path, required=True, metavar="W.npz", help="the trained model")
    verb.add_argument("--examples", type=Path, required=True, metavar="FOLDER", help="recordings with annotations")
    add_options(verb, "throw.evaluate")
    verb.set_defaults(run=run_evaluate)
    return verb


def run_evaluate(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `throw evaluate`: regenerate every example and measure its errors.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.tables import write_report
    from ..files.whole import atomic_write
    from ..throws.evaluate_throws import FULL, RAW, evaluate_throws, some_of_each
    from ..throws.network_npz import read_model
    from ..throws.throw_examples import TABLE_NAME
    from ..throws.throws_page import throws_page

    begun = time.perf_counter()
    check_outputs(options.report, options.html, never=(options.model, options.examples / TABLE_NAME))
    model = read_model(options.model)
    every = _read_examples(options.examples, model, told)
    chosen = some_of_each(_choose_subjects(every, options.subject, options.examples), options.motions)
    loaded = time.perf_counter()
    found = evaluate_throws(
        model, chosen, RAW if options.raw else FULL, by_height=not options.as_they_are, progress=told.progress,
        cancelled=told.cancelled,
    )  # fmt: skip
    for line in found.left_out:
        told.note(line)
    report = {
        "version": __version__, "model": str(options.model), "trained_on": model.trained_on,
        "examples": str(options.examples), **found.report(),
        "elapsed": {"load": loaded - begun, "evaluate": time.perf_counter() - loaded},
    }  # fmt: skip
    write_report(options.report, report)
    if options.html:
        atomic_write(options.html, throws_page(report))
    told.end()
    print(f"{options.report}: {report['motions']} of {len(chosen)} motions")


def _read_examples(folder: Path, model, told: Told) -> list:
    """Read the examples of a folder.

    Examples on the model's joint names stay as they are; otherwise all are retargeted to the model's skeleton, because
    hands with another rest pose rotate differently.
    """
    from ..throws.throw_examples import examples_in

    settings = model.settings
    found = examples_in(folder, settings.action, settings.fps, told=told.note, cancelled=told.cancelled)
    if all(example.motion.skeleton.names == model.skeleton.names for example in found):
        return found
    told.note(f"{folder}: skeletons differ from the model's; motions are retargeted to it")
    return examples_in(folder, settings.action, settings.fps, model.skeleton, cancelled=told.cancelled)


def _choose_subjects(examples, wanted: list[str], folder: Path):
    """Select the examples of some subjects, all without any name; InputError for an unknown subject."""
    there = sorted({example.subject for example in examples})
    for name in wanted:
        if name not in there:
            raise InputError("--subject", name, f"one of {', '.join(there)}", f"see {folder}")
    return [example for example in examples if not wanted or example.subject in wanted]


def _add_examples(verbs):
    verb = verbs.add_parser("examples", help="write synthetic throws or kicks with known targets to train and test")
    verb.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="a new or empty folder")
    add_options(verb, "throw.examples")
    verb.set_defaults(run=run_examples)
    return verb


def run_examples(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `throw examples`: write synthetic throws or kicks with known targets.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..throws.planted_examples import write_planted
    from ..throws.throw_examples import TABLE_NAME

    begun = time.perf_counter()
    count = write_planted(options.out, options.action, options.subjects, count=options.throws, seed=options.seed,
                          progress=told.progress, cancelled=told.cancelled)
    told.end()
    seconds = time.perf_counter() - begun
    who = "person" if options.subjects == 1 else "people"
    what = f"{count} {options.action}{'s' * (count > 1)} of {options.subjects} {who}"
    print(f"{options.out}: {what}, with {TABLE_NAME}, in {seconds:.1f} s")
