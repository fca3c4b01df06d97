"""The verb `throw`: throws and kicks from trained networks, with the verbs train, synthesize, evaluate and examples."""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from .. import __version__
from ..base.errors import InputError, format_seconds
from ..base.settings.options import add_options, parse_path
from .outputs import ProgressReporter, Writer, add_subverbs, build_take, check_outputs, choose_writer, locate_errors

if TYPE_CHECKING:
    from ..library.library import Library
    from ..synthesis.plan import Plan
    from ..throws.throw_request import ThrowResult

_FARTHEST = 1e5  # m


def add_throw(verbs):
    """Add the verb `throw`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("throw", help="throws and kicks from networks: train, synthesize, evaluate, examples")
    return add_subverbs(verb, "throw_verb", *(_add_train, _add_synthesize, _add_evaluate, _add_examples))


def _add_train(verbs):
    verb = verbs.add_parser("train", help="train networks on a folder of BVH and annotations (see make training)")
    verb.add_argument("folder", type=parse_path, metavar="FOLDER",
                      help="recordings, annotations and optionally throws.csv")
    verb.add_argument("--out", type=parse_path, required=True, metavar="W.npz", help="the trained model")
    add_options(verb, "throw.train")
    verb.set_defaults(run=run_train)
    return verb


def run_train(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `throw train`: train a model and write it.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    check_outputs(options.out, reserved=(options.config, options.skeleton))
    if options.out.suffix.lower() != ".npz":
        raise InputError(options.out, "not a weights file", "a name ending in .npz", "choose another file type")
    _require_training()
    from training.train import train_folder

    train_folder(options, reporter)


def _require_training() -> None:
    """Raise InputError if jax, optax or the project's `training` folder is missing, for example in Blender."""
    core = __name__.partition(".cli.")[0]
    try:
        if core != "beyond_mocap":  # inside Blender the core has another name, but training imports it by this one
            raise ImportError
        import training  # noqa: F401, I001  # first: it sets where jax, once imported, keeps compiled code
        import jax  # noqa: F401
        import optax  # noqa: F401
    except ImportError:
        raise InputError(
            "throw train", "this Python cannot train", "jax, optax and the project's folder",
            "in the project's folder run 'make training', then .venv-training/bin/python -m beyond_mocap throw train "
            "...; or pip install '.[training]'",
        ) from None


def _add_synthesize(verbs):
    verb = verbs.add_parser("synthesize", help="a throw or kick that hits a target")
    verb.add_argument("--target", type=_parse_point, required=True, metavar="X,Y,Z", help="metres, Z up")
    verb.add_argument("--out", type=parse_path, required=True, metavar="OUT.bvh", help="the motion")
    verb.add_argument("--model", type=parse_path, metavar="W.npz",
                      help="default: the project's weights of synthetic motion, 13 to 16 cm off real kicks; "
                      "recorded: its weights of five recorded kicks; see docs/reference/model-card.md")
    add_options(verb, "throw")
    place = verb.add_mutually_exclusive_group()
    place.add_argument("--start", type=_parse_ground_point, metavar="X,Y", help="hips in the first frame; default 0,0")
    place.add_argument("--over", type=_parse_ground_point, metavar="X,Y", help="position of the hips at the release")
    place.add_argument("--ball-place", type=_parse_ground_point, metavar="X,Y",
                       help="position of the ball that is kicked")
    add_options(verb, "throw.ball")
    verb.add_argument("--library", type=parse_path, metavar="L", help="with --track: source of run-up and recovery")
    verb.add_argument("--track", type=parse_path, metavar="T.csv",
                      help="the player's track; the throw is on it at --time")
    verb.add_argument("--annotations", type=parse_path, metavar="A.txt", help="the player's other actions on the track")
    add_options(verb, "library", "cache", "unit")
    verb.set_defaults(run=run_synthesize)
    return verb


def run_synthesize(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `throw synthesize`: synthesize a throw or kick and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.tables import write_ball, write_report
    from ..throws.throw import throw_at

    started = time.perf_counter()
    inputs = (options.model, options.skeleton, options.track, options.annotations)
    check_outputs(options.out, options.ball, options.report, reserved=inputs, library=options.library,
                  motion=options.out)
    write = choose_writer(options.out, writers)
    _check_combination(options)
    model = _read_chosen_model(options)
    player = _Player.from_options(options, model, reporter) if options.library else None
    skeleton, form = _read_skeleton(options, player)
    loaded = time.perf_counter()
    order = _build_order(options, player)
    result = throw_at(model, order, skeleton, reporter.show_progress, reporter.is_cancelled)
    notes = list(result.warnings)
    if player is not None:
        result, lines = player.insert_throw(result, reporter)
        notes += lines
    done = time.perf_counter()
    notes += _write_motion(options.out, result, form, write)
    if options.ball:
        write_ball(options.ball, result.path)
    if options.report:
        seconds = {"load": loaded - started, "throw": done - loaded}
        write_report(options.report, {"version": __version__, "seed": options.seed, **result.build_report(),
                                      "warnings": notes, "seconds": seconds})  # fmt: skip
    reporter.finish(notes)
    verb = "struck" if result.grip is None else "released"
    print(
        f"{options.out}: {len(result.motion)} frames, {verb} at {result.release_time:.3f} s with {result.speed:.1f} "
        f"m/s, {100 * result.impact_error:.1f} cm from the target, {100 * result.displacement:.1f} cm moved"
    )


def _check_combination(options) -> None:
    """Check that no option lacks another one that it needs."""
    for option, required, why in (("library", "track", "a player's track"),
                                  ("track", "library", "a folder of recordings"),
                                  ("cache", "library", "a folder of recordings"),
                                  ("annotations", "track", "a player's track"),
                                  ("track", "time", "the time of the ball's release")):  # fmt: skip
        if getattr(options, option) and getattr(options, required) is None:
            raise InputError(f"--{option}", f"set without --{required}", why, f"add --{required}")


def _write_motion(out: Path, result: ThrowResult, form, write: Writer) -> list[str]:
    """Write the motion: in the form of its skeleton's file, or of the suffix's writer; returns notes."""
    if form is not None and out.suffix.lower() == ".bvh":
        from ..files.bvh import bvh

        return [f"{out}: {note}" for note in bvh.write_bvh(out, result.motion, form)]
    import numpy as np

    still = np.zeros((len(result.motion), 2))
    write(build_take(result.motion, "throw", "throw", start_time=result.start_time, ball=result.path,
                     warnings=result.warnings, correction=still, ik_miss=still), out)  # fmt: skip
    return []


def _parse_point(text: str, count: int = 3) -> tuple[float, ...]:
    """Parse numbers separated by commas, in metres."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(abs(value) < _FARTHEST for value in values):
        raise argparse.ArgumentTypeError(f"{text!r} is not {'X,Y,Z' if count == 3 else 'X,Y'} in metres, each "
                                         f"of less than {_FARTHEST / 1000.0:g} km")
    return values


def _parse_ground_point(text: str) -> tuple[float, ...]:
    return _parse_point(text, 2)


def _read_chosen_model(options):
    """Read the model of the command line; without one, the supplied model for the limb's action."""
    from ..throws.network_npz import read_chosen_model

    kicks = options.ball_place is not None or (options.limb or "").endswith("foot")
    return read_chosen_model(options.model, "kick" if kicks or _is_recorded(options.model) else "throw")


def _is_recorded(model: Path | None) -> bool:
    """Return whether the project's weights of recordings are chosen, which are of kicks alone."""
    from ..throws.network_npz import RECORDED

    return str(model) == RECORDED


def _read_skeleton(options, player):
    """Read the skeleton and the form of its file; (None, None) for the model's own."""
    if options.skeleton is None:
        return (player.library.skeleton if player else None), None
    from ..files.bvh import bvh
    from ..motion.humanoid import identify_joints

    clip = bvh.read_bvh(options.skeleton, options.unit)
    with locate_errors(options.skeleton):
        identify_joints(clip.motion.skeleton)
    return clip.motion.skeleton, clip.form


def _build_order(options, player):
    """Build the request of the throw from the command line."""
    from ..throws.throw import ThrowRequest

    over = options.over
    if player is not None and not (options.start or options.over or options.ball_place):
        over = player.find_position(options.time)
    fps = options.fps or (player.plan.fps if player else None)
    return ThrowRequest(
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
    time: float

    @classmethod
    def from_options(cls, options, model, reporter: ProgressReporter) -> _Player:
        """Read library, track and annotations of the command line."""
        from ..annotation import Timeline, read_timeline
        from ..files.tracking.tracking import read_track_csv
        from ..library.build import build_library
        from ..motion.track import clean_track
        from ..synthesis.plan import Plan

        track, _ = clean_track(read_track_csv(options.track))
        if not track.times[0] <= options.time <= track.times[-1]:
            expected = f"{format_seconds(track.times[0])} to {format_seconds(track.times[-1])} s, the track"
            raise InputError("--time", f"{format_seconds(options.time)} s", expected)
        fps = options.fps or 30.0
        timeline = Timeline()
        if options.annotations:
            timeline = read_timeline(options.annotations, fps, float(track.times[0]))
        library = build_library(options.library, cache_dir=options.cache, unit=options.unit,
                                progress=reporter.show_progress, cancelled=reporter.is_cancelled)
        plan = Plan(track=track, timeline=timeline, library=str(options.library), fps=fps, seed=options.seed,
                    solve_touches=False)
        return cls(library, plan, model.settings.action, options.time)

    def find_position(self, time: float) -> tuple[float, ...]:
        """Find the track's position (2,) m at a time."""
        import numpy as np

        track = self.plan.sample_track(self.plan.fps)
        return tuple(float(np.interp(time, track.times, column)) for column in track.positions.T)

    def insert_throw(self, result, reporter: ProgressReporter):
        """Insert the throw into the player's motion; return it with lines for the user."""
        from ..throws.join_throw import join_throw, trim_waiting
        from ..throws.run_up import EDGE, construct_run_up
        from ..throws.throw_request import place_in_motion

        motion, release = trim_waiting(result.motion, result.release, EDGE)
        first = round((result.release - release) * result.motion.fps)
        shift = result.shift[first : first + len(motion)]
        result = replace(result, motion=motion, release=release, shift=shift)
        run_up = construct_run_up(self.library, self.plan, result.motion, result.release, self.time, action=self.action,
                                  progress=reporter.show_progress, cancelled=reporter.is_cancelled)
        whole = join_throw(run_up.motion, run_up.start, result.motion, result.release, at=self.time)
        return place_in_motion(result, whole.motion, whole.start, whole.release, whole.first), [*run_up.warnings,
                *whole.warnings]


def _add_evaluate(verbs):
    verb = verbs.add_parser("evaluate", help="measure trained networks on recorded throws or kicks")
    verb.add_argument("--model", type=parse_path, required=True, metavar="W.npz",
                      help="the trained model; recorded: the project's weights of recorded kicks")
    verb.add_argument("--examples", type=parse_path, required=True, metavar="FOLDER",
                      help="recordings with annotations")
    add_options(verb, "throw.evaluate")
    verb.set_defaults(run=run_evaluate)
    return verb


def run_evaluate(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `throw evaluate`: regenerate every example and measure its errors.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.atomic import atomic_write
    from ..files.tables import write_report
    from ..throws.evaluate_throws import FULL_OPTIONS, RAW_OPTIONS, evaluate_throws, select_of_each
    from ..throws.network_npz import read_chosen_model
    from ..throws.throw_examples import TABLE_NAME
    from ..throws.throws_page import build_throws_page

    started = time.perf_counter()
    check_outputs(options.report, options.html, reserved=(options.model, options.examples / TABLE_NAME))
    model = read_chosen_model(options.model, "kick")
    examples = read_test_examples(options.examples, model, reporter)
    chosen = select_of_each(select_subjects(examples, options.subject, options.examples), options.motions)
    loaded = time.perf_counter()
    evaluation = evaluate_throws(
        model, chosen, RAW_OPTIONS if options.raw else FULL_OPTIONS, by_height=not options.as_they_are,
        progress=reporter.show_progress, cancelled=reporter.is_cancelled,
    )  # fmt: skip
    for line in evaluation.left_out:
        reporter.show_note(line)
    report = {
        "version": __version__, "model": str(options.model), "trained_on": model.trained_on,
        "examples": str(options.examples), **evaluation.build_report(),
        "elapsed": {"load": loaded - started, "evaluate": time.perf_counter() - loaded},
    }  # fmt: skip
    write_report(options.report, report)
    if options.html:
        atomic_write(options.html, build_throws_page(report))
    reporter.finish()
    print(f"{options.report}: {report['motions']} of {len(chosen)} motions")


def read_test_examples(folder: Path, model, reporter: ProgressReporter) -> list:
    """Read the examples of a folder to evaluate a model on.

    Examples on the model's joint names stay as they are; otherwise all are retargeted to the model's skeleton, because
    hands with another rest pose rotate differently.

    Args:
        folder: folder of recordings.
        model: the model.
        reporter: receives notes.
    Returns:
        The examples.
    Raises:
        InputError: if there is no example.
    """
    from ..throws.throw_examples import read_examples

    settings = model.settings
    examples = read_examples(folder, settings.action, settings.fps, report=reporter.show_note,
                             cancelled=reporter.is_cancelled)
    if all(example.motion.skeleton.names == model.skeleton.names for example in examples):
        return examples
    reporter.show_note(f"{folder}: skeletons differ from the model's; motions are retargeted to it")
    return read_examples(folder, settings.action, settings.fps, model.examples[0].motion,
                         cancelled=reporter.is_cancelled)


def select_subjects(examples, subjects, folder: Path) -> list:
    """Select the examples of some subjects.

    Args:
        examples: the examples.
        subjects: names of the subjects; if empty, all.
        folder: folder of the examples, for the error.
    Returns:
        The selected examples.
    Raises:
        InputError: for an unknown subject.
    """
    known = sorted({example.subject for example in examples})
    for name in subjects:
        if name not in known:
            raise InputError("--subject", name, f"one of {', '.join(known)}", f"see {folder}")
    return [example for example in examples if not subjects or example.subject in subjects]


def _add_examples(verbs):
    verb = verbs.add_parser("examples", help="write synthetic throws or kicks with known targets to train and test")
    verb.add_argument("--out", type=parse_path, required=True, metavar="FOLDER", help="a new or empty folder")
    add_options(verb, "throw.examples")
    verb.set_defaults(run=run_examples)
    return verb


def run_examples(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `throw examples`: write synthetic throws or kicks with known targets.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..throws.synthetic_examples import write_examples
    from ..throws.throw_examples import TABLE_NAME

    started = time.perf_counter()
    count = write_examples(options.out, options.action, options.subjects, count=options.throws, seed=options.seed,
                           progress=reporter.show_progress, cancelled=reporter.is_cancelled)
    reporter.finish()
    seconds = time.perf_counter() - started
    who = "person" if options.subjects == 1 else "people"
    what = f"{count} {options.action}{'s' * (count > 1)} of {options.subjects} {who}"
    print(f"{options.out}: {what}, with {TABLE_NAME}, in {seconds:.1f} s")
