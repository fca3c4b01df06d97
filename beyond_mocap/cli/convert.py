"""The verbs `mirror`, `retarget` and `stream`: mirror a recording, move it to another skeleton, or send it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from ..base.errors import InputError
from ..base.settings.options import add_options, parse_path
from .outputs import ProgressReporter, Writer, check_outputs, choose_writer, locate_errors


def add_mirror(verbs) -> argparse.ArgumentParser:
    """Add the verb `mirror`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("mirror", help="exchange left and right of a motion")
    verb.add_argument("input", type=parse_path, metavar="IN.bvh", help="the motion")
    verb.add_argument("output", type=parse_path, metavar="OUT.bvh", help="the mirrored motion")
    add_options(verb, "mirror")
    verb.set_defaults(run=run_mirror)
    return verb


def add_retarget(verbs) -> argparse.ArgumentParser:
    """Add the verb `retarget`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("retarget", help="move a motion to another skeleton")
    verb.add_argument("input", type=parse_path, metavar="IN", help="the motion: BVH, or SMPL as .npz")
    verb.add_argument("--to", type=parse_path, required=True, metavar="SKELETON",
                      help="a clip with the new skeleton; smpl for SMPL's joints")
    verb.add_argument("--out", type=parse_path, required=True, metavar="OUT",
                      help="the motion on it: .bvh in centimetres, or .npz with --to smpl")
    verb.add_argument("--map", type=parse_path, metavar="M.json",
                      help="a JSON object, joint of IN -> joint of SKELETON")
    add_options(verb, "retarget")
    verb.set_defaults(run=run_retarget)
    return verb


def run_mirror(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `mirror`: write the motion with left and right exchanged.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.bvh import bvh
    from ..motion.mirror import mirror

    check_outputs(options.output, reserved=(options.input,))
    choose_writer(options.output, {}, hint="")
    clip = bvh.read_bvh(options.input, options.unit)
    with locate_errors(options.input):
        mirrored = mirror(clip.motion)
    bvh.write_bvh(options.output, mirrored, clip.form)
    reporter.finish(clip.notes)
    print(f"{options.output}: {len(clip.motion)} frames")


def run_retarget(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `retarget`: write the motion on another skeleton, with that skeleton's joint names and channels.

    The output has the input's frame rate.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..library.common_skeleton import retarget_clip
    from ..motion.humanoid import identify_posed_joints

    check_outputs(options.out, reserved=(options.input, options.to, options.map))
    write = _choose_clip_writer(options)
    clip = _read_input(options)
    target = _read_target(options, clip.motion)
    try:
        motion = retarget_clip(clip.motion, target.motion, options.map)
    except InputError as error:
        if error.where != "skeleton":
            raise
        for path, motion in ((options.input, clip.motion), (options.to, target.motion)):
            with locate_errors(path):
                identify_posed_joints(motion)
        raise InputError(f"{options.input} to {options.to}", str(error)) from None  # skeletons do not know the file
    notes = write(options.out, motion, target.form)
    lines = [*((options.input, note) for note in _list_notes(clip)), *((options.to, note) for note in target.notes[:1]),
             *((options.out, note) for note in notes)]
    reporter.finish(f"{path}: {note}" for path, note in lines)
    print(f"{options.out}: {len(motion)} frames")


def _choose_clip_writer(options):
    """Choose the function that writes the clip: BVH, or SMPL's form for its skeleton."""
    from ..files.bvh.bvh import write_bvh
    from ..files.smpl.smpl import write_smpl

    if options.out.suffix.lower() != ".npz":
        choose_writer(options.out, {}, hint="")
        return write_bvh
    if not _is_to_smpl(options):
        raise InputError(options.out, "an .npz for another skeleton than SMPL's", "a .bvh file, or --to smpl",
                         "change one of them")
    return lambda out, motion, form: write_smpl(out, motion)


def _is_to_smpl(options) -> bool:
    return str(options.to).lower() == "smpl" and not options.to.exists()


def _read_input(options):
    """Read the clip that is retargeted."""
    from ..files.clip_file import read_clip
    from ..files.smpl.smpl import read_smpl

    if options.input.suffix.lower() == ".npz":
        if options.unit is not None:
            raise InputError("--unit", f"set for {options.input}, which is in metres", "a BVH file", "leave it out")
        if options.stature is not None and options.body_model is not None:
            raise InputError("--stature", "set beside --body-model, which has the person's size", "one of them",
                             "leave one out")
        return read_smpl(options.input, options.stature, options.body_model)
    for name in ("stature", "body_model"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name.replace('_', '-')}", f"set for {options.input}", "a motion of SMPL as .npz",
                             "leave it out")
    return read_clip(options.input, options.unit)


def _read_target(options, motion):
    """Read the clip with the new skeleton; SMPL's is as tall as the body of the motion."""
    from ..files.bvh.bvh import BvhClip
    from ..files.bvh.bvh_write import BvhForm
    from ..files.clip_file import read_clip
    from ..files.smpl.smpl_skeleton import build_smpl_pose
    from ..motion.humanoid import estimate_stature

    if not _is_to_smpl(options):
        return read_clip(options.to, options.to_unit)
    if options.to_unit is not None:
        raise InputError("--to-unit", "set for SMPL, which is in metres", "a BVH file", "leave it out")
    with locate_errors(options.input):
        return BvhClip(build_smpl_pose(estimate_stature(motion.skeleton)), BvhForm(), ())


def _list_notes(clip) -> tuple[str, ...]:
    """List the notes on a clip that was read: of BVH the unit alone."""
    return clip.notes if clip.form.channels == {} else clip.notes[:1]


def add_stream(verbs):
    """Add the verb `stream`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("stream", help="send a recording like a mocap suit, on this machine only")
    verb.add_argument("clip", type=parse_path, metavar="CLIP.bvh", help="the recording to send")
    add_options(verb, "stream")
    add_options(verb.add_mutually_exclusive_group(), "stream.way")
    add_options(verb, "stream.send")
    verb.set_defaults(run=run_stream)
    return verb


def run_stream(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `stream`: send the recording to its end.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..passes.stream.sender import Sender

    transport = "tcp" if options.tcp else "serve" if options.serve else "udp"
    sender = Sender(options.clip, options.port, transport, form=options.form, rate=options.fps, loop=options.loop)
    where = f"port {options.port} of this machine ({transport.upper()}, {options.form})"
    print(f"sending {options.clip.name} to {where}", flush=True)
    count = len(sender.rows)
    sent = sender.send_file(reporter.is_cancelled, lambda frame: reporter.show_progress((frame - 1) % count / count,
            "Sending"))
    reporter.finish()
    print(f"{sent} frames sent")
    if not options.loop:
        reporter.check_cancelled()
