"""The verb `stream`: a recording sent over this machine's own network, as a suit would send it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from .numbers import between, whole
from .outputs import Writer
from .told import Told


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("stream", help="send a recording as a motion capture suit does, on this machine only")
    verb.add_argument("clip", type=Path, metavar="CLIP.bvh")
    verb.add_argument("--port", type=partial(whole, low=1024, high=65535, expected="1024 to 65535"), default=7001)
    ways = verb.add_mutually_exclusive_group()
    ways.add_argument("--tcp", action="store_true", help="connect to who listens (default: UDP datagrams)")
    ways.add_argument("--serve", action="store_true", help="wait until somebody connects, as Axis Neuron does")
    verb.add_argument("--form", choices=("bvh", "neuron"), default="bvh", help="of the text; neuron has no hierarchy")
    verb.add_argument("--fps", type=partial(between, low=1.0, high=1000.0, expected="1 to 1000"), metavar="RATE",
                      help="frames a second; default: the file's")  # fmt: skip
    verb.add_argument("--loop", action="store_true", help="again and again, until Ctrl-C")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`stream`: sends until the recording's end."""
    from ..stream.sender import Sender

    way = "tcp" if options.tcp else "serve" if options.serve else "udp"
    sender = Sender(options.clip, options.port, way, options.form, options.fps, options.loop)
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
