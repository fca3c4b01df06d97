"""The verb `stream`: a recording sent over this machine's own network, as a suit would send it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..base.settings.options import add_options
from .outputs import Writer
from .progress_reporter import Told


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("stream", help="send a recording as a motion capture suit does, on this machine only")
    verb.add_argument("clip", type=Path, metavar="CLIP.bvh")
    add_options(verb, "stream")
    add_options(verb.add_mutually_exclusive_group(), "stream.way")
    add_options(verb, "stream.send")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`stream`: sends until the recording's end."""
    from ..passes.stream.sender import Sender

    way = "tcp" if options.tcp else "serve" if options.serve else "udp"
    sender = Sender(options.clip, options.port, way, form=options.form, rate=options.fps, loop=options.loop)
    print(
        f"sending {options.clip.name} to port {options.port} of this machine ({way.upper()}, {options.form})",
        flush=True,
    )
    count = len(sender.rows)
    sent = sender.run(told.cancelled, lambda frame: told.progress((frame - 1) % count / count, "Sending"))
    told.end()
    print(f"{sent} frames sent")
    if not options.loop:
        told.check()
