"""A recording sent as a suit would send it, for people without one: at its own rate, to this machine only."""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Callable
from pathlib import Path

from ...base.errors import InputError
from ...files.bvh import bvh_text
from .bvh_stream import hierarchy_of
from .listener import LOOPBACK

FORMS = ("bvh", "neuron")
WAYS = ("udp", "tcp", "serve")
"""Datagrams; connecting to who listens; or waiting for who calls, as Axis Neuron does."""
_HEADER_EVERY = 1.0
_TICK = 0.2
_AVATAR = "0 Avatar00 "
_LARGEST_DATAGRAM = 60000


class Sender:
    """Sends a BVH file. way: of WAYS. form: of FORMS. rate: frames a second (None: the file's).
    loop: again and again."""

    def __init__(self, path, port: int, way: str = "udp", form: str = "bvh", rate: float | None = None,
                 loop: bool = False):
        if way not in WAYS or form not in FORMS:
            raise InputError("stream", f"{way}, {form}", f"one of {', '.join(WAYS)} and one of {', '.join(FORMS)}")
        text = bvh_text.parse(path)
        self.path, self.port, self.way, self.form, self.loop = Path(path), int(port), way, form, loop
        self.frame_time = text.frame_time if rate is None else 1.0 / rate
        self.header = f"{hierarchy_of(path)}\nMOTION\nFrames: {len(text.values)}\nFrame Time: {self.frame_time:.6f}\n"
        lead, end = (_AVATAR, " ||") if form == "neuron" else ("", "\n")
        self.rows = [lead + " ".join(f"{value:.4f}" for value in row) + end for row in text.values]
        if way == "udp" and max(len(self.header), len(self.rows[0])) > _LARGEST_DATAGRAM:
            raise InputError(path, "a frame or hierarchy larger than a datagram", "60 kB", "send it with --tcp")

    def run(self, stopped: Callable[[], bool], told: Callable[[int], None] = lambda frames: None) -> int:
        """Send until the file's end (loop: until `stopped` says so); how many frames went out. told(frame) after each.
        InputError where nobody listens."""
        out = self._connected(stopped)
        if out is None:
            return 0
        with out:
            return self._send(out, stopped, told)

    def _connected(self, stopped: Callable[[], bool]) -> socket.socket | None:
        if self.way == "udp":
            out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            out.connect((LOOPBACK, self.port))
            return out
        if self.way == "serve":
            return self._called(stopped)
        try:
            return socket.create_connection((LOOPBACK, self.port), timeout=5.0)
        except OSError as error:
            found = f"nobody listens ({error.strerror or error})"
            raise InputError(f"port {self.port}", found, "a listener", "start the stream in Blender first") from None

    def _called(self, stopped: Callable[[], bool]) -> socket.socket | None:
        """The connection of the first who calls; None where it was stopped before."""
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as server:
            if os.name != "nt":  # there it lets two programs share a port
                server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                server.bind((LOOPBACK, self.port))
            except OSError as error:
                raise InputError(f"port {self.port}", f"cannot be used ({error.strerror})", "a free port") from None
            server.listen(1)
            while not stopped():
                if select.select([server], [], [], _TICK)[0]:
                    client = server.accept()[0]
                    client.settimeout(5.0)
                    return client
        return None

    def _send(self, out: socket.socket, stopped: Callable[[], bool], told) -> int:
        begun, frame, header_due = time.monotonic(), 0, 0.0
        while not stopped() and (self.loop or frame < len(self.rows)):
            due = begun + frame * self.frame_time
            early = due - time.monotonic()
            if early > 0.0:
                time.sleep(min(_TICK, early))
                continue
            if self.form == "bvh" and due >= header_due:
                self._put(out, self.header)
                header_due = due + _HEADER_EVERY if self.way == "udp" else float("inf")
            clock = f"# sent {time.time():.6f}\n" if self.form == "bvh" else ""
            if not self._put(out, clock + self.rows[frame % len(self.rows)]):
                break
            frame += 1
            told(frame)
        return frame

    def _put(self, out: socket.socket, text: str) -> bool:
        """Whether it went out; a datagram that nobody takes is no trouble."""
        try:
            out.sendall(text.encode())
            return True
        except (ConnectionRefusedError, BlockingIOError):
            return self.way == "udp"
        except OSError:
            return False
