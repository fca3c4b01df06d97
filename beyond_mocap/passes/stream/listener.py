"""Listener for a BVH stream on this machine: one thread receives what arrives, the display asks for it.

Only the loopback address is bound or called, so nothing from another machine comes in and nothing goes out. Frames stay
in a ring buffer of some seconds. The thread never waits longer than a fifth of a second, reads a limited number of
bytes per second, and ends with `stop`, which also closes all sockets.
"""

from __future__ import annotations

import atexit
import os
import select
import socket
import statistics
import threading
import time
import weakref
from collections import deque
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, format_count
from ...files.bvh.bvh import BvhRows
from ...motion.skeleton import Skeleton
from .bvh_stream import BvhStream

LOOPBACK = "127.0.0.1"
PORT = 7001
PROTOCOLS = ("udp", "tcp", "call")
"""Datagrams that arrive; a sender connects to us; or we connect to a waiting sender, as Axis Neuron is."""
STALL_SECONDS = 1.0
"""Seconds without a frame after which a stream counts as stalled."""
_PROTOCOL_NAMES = {"udp": "UDP", "tcp": "TCP", "call": "TCP"}
_TICK = 0.2  # s: longest wait for a socket
_CHUNK = 1 << 16  # bytes read at once
_BYTES_PER_SECOND = 8 << 20  # bytes read per second
_RECONNECT_SECONDS = 1.0  # s between two attempts to connect
_RING_FRAMES = 6000  # frames in the ring buffer at most
_MEASURED_FRAMES = 60  # latest frames from which rate and delay are measured
_listeners: weakref.WeakSet[Listener] = weakref.WeakSet()


@dataclass(frozen=True, eq=False, kw_only=True)
class StreamFrame:
    """A frame that has arrived.

    Attributes:
        number: counts from 1.
        time: s of the monotonic clock at which it arrived.
        sent: s of the same clock at which it was sent, or None.
        values: (C,) channels in the stream's units.
        rows: converts such values to poses.
    """

    number: int
    time: float
    sent: float | None
    values: np.ndarray
    rows: BvhRows


@dataclass(frozen=True, kw_only=True)
class StreamStatus:
    """The state of a stream.

    Attributes:
        state: "waiting" (no frame yet), "receiving", "stalled", "ended" (the sender has closed the connection),
            "failed", or "stopped".
        frames: total number of frames.
        rate: frames per second, recently.
        delay: median delay in s from sender to listener; None if the sender sends no times.
        invalid_count: number of invalid pieces.
        line: one line for the user.
    """

    state: str
    frames: int
    rate: float
    delay: float | None
    invalid_count: int
    line: str


class Listener:
    """Receives one stream at a time.

    Args:
        port: 1024 to 65535.
        protocol: one of PROTOCOLS.
        hierarchy: text of a BVH HIERARCHY section, for streams without one.
        unit: metres per unit of the stream; None: guessed.
        seconds: how long frames stay in the ring buffer.
    Raises:
        InputError: for an unknown protocol or a port out of range.
    """

    def __init__(self, port: int = PORT, protocol: str = "udp", hierarchy: str | None = None, unit: float | None = None,
                 seconds: float = 20.0):
        if protocol not in PROTOCOLS:
            raise InputError("protocol", f"{protocol!r}", f"one of {', '.join(PROTOCOLS)}")
        if not 1024 <= int(port) <= 65535:
            raise InputError("port", f"{port}", "1024 to 65535", f"suits often use {PORT}")
        self.port, self.protocol, self.seconds = int(port), protocol, seconds
        self.stream = BvhStream(hierarchy, unit)
        self._lock = threading.Lock()
        self._ring: deque[StreamFrame] = deque(maxlen=_RING_FRAMES)
        self._count = 0
        self._stop = threading.Event()
        self._state, self._reason = "waiting", ""
        self._bytes_read, self._second_start = 0, 0.0
        self._thread: threading.Thread | None = None
        self._server: socket.socket | None = None

    def start(self) -> "Listener":
        """Bind the port and start the thread.

        Raises:
            InputError: if another program uses the port.
        """
        if self.protocol != "call":
            kind = socket.SOCK_DGRAM if self.protocol == "udp" else socket.SOCK_STREAM
            self._server = socket.socket(socket.AF_INET, kind)
            try:
                if self.protocol == "tcp" and os.name != "nt":  # on Windows it would let two programs share a port
                    self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                self._server.bind((LOOPBACK, self.port))
                if self.protocol == "tcp":
                    self._server.listen(1)
            except OSError as error:
                self._server.close()
                raise InputError(f"port {self.port}", f"not available ({error.strerror or error})",
                                 "a free port", "choose another one, or stop the program that uses it") from None
        self._thread = threading.Thread(target=self._receive, name="beyond_mocap stream", daemon=True)
        _listeners.add(self)
        self._thread.start()
        return self

    def stop(self) -> None:
        """End the thread and close all sockets; repeated calls are allowed."""
        self._stop.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(5.0 * _TICK)
        self._state = "stopped" if self._state != "failed" else self._state
        _listeners.discard(self)

    @property
    def is_running(self) -> bool:
        """Whether the thread still listens."""
        return self._thread is not None and self._thread.is_alive() and not self._stop.is_set()

    def frames_since(self, number: int = 0) -> list[StreamFrame]:
        """List the frames after frame `number` that are still in the ring buffer, oldest first."""
        with self._lock:
            frames = []
            for frame in reversed(self._ring):
                if frame.number <= number:
                    break
                frames.append(frame)
        return frames[::-1]

    def latest_frame(self) -> StreamFrame | None:
        """Find the newest frame; None if there is none."""
        with self._lock:
            return self._ring[-1] if self._ring else None

    def measure_status(self) -> StreamStatus:
        """Measure the state of the stream now."""
        now = time.monotonic()
        with self._lock:
            recent = list(self._ring)[-_MEASURED_FRAMES:]
            count = self._count
        idle = now - recent[-1].time if recent else 0.0
        rate = 0.0
        if len(recent) > 1 and idle <= STALL_SECONDS:
            rate = (len(recent) - 1) / max(recent[-1].time - recent[0].time, 1e-6)
        delays = [delay for delay in map(_compute_delay, recent) if delay is not None]
        state = self._state
        if state == "receiving" and idle > STALL_SECONDS:
            state = "stalled"
        delay = statistics.median(delays) if delays else None
        return StreamStatus(state=state, frames=count, rate=rate, delay=delay,
                            invalid_count=self.stream.invalid_count, line=self._describe(state, rate, idle))

    def _describe(self, state: str, rate: float, idle: float) -> str:
        """Describe the state in one line for the user."""
        port_name = f"{_PROTOCOL_NAMES[self.protocol]} port {self.port}"
        if state == "receiving":
            return f"{rate:.0f} frames per second on {port_name}"
        if state == "stalled":
            return f"The stream has stalled: no frame for {idle:.0f} s on {port_name}; start the sender again"
        if state == "ended":
            return f"The sender has closed the connection ({port_name}); waiting for it to connect again"
        if state == "failed":
            return f"The stream has failed: {self._reason}; stop it and start it again"
        if state == "stopped":
            return "Not listening"
        if self.stream.invalid_count:
            count = format_count(self.stream.invalid_count, "invalid piece")
            return f"{count} on {port_name}: {self.stream.last_error}"
        if self._reason:
            return f"{self._reason} ({port_name})"
        return f"Waiting for frames on {port_name} of this machine"

    def _receive(self) -> None:
        """Receive until stopped; an error ends in the state "failed"."""
        try:
            {"udp": self._receive_datagrams, "tcp": self._accept_connections,
             "call": self._call_sender}[self.protocol]()
        except Exception as error:  # a thread that ends silently would look like a waiting stream
            self._state, self._reason = "failed", f"{type(error).__name__}: {error}"
        finally:
            if self._server is not None:
                self._server.close()

    def _receive_datagrams(self) -> None:
        """Receive UDP datagrams."""
        while not self._stop.is_set():
            if _is_readable(self._server):
                try:
                    data = self._server.recv(_CHUNK)
                except OSError:  # Windows reports resets for datagrams that were never sent
                    continue
                self._add_bytes(data, whole=True)

    def _accept_connections(self) -> None:
        """Accept TCP connections, one at a time; a new one replaces the old one."""
        client = None
        try:
            while not self._stop.is_set():
                waiting = [self._server] if client is None else [self._server, client]
                ready, _, _ = select.select(waiting, [], [], _TICK)
                if self._server in ready:
                    client = self._replace_connection(client, self._server.accept()[0])
                elif client in ready and not self._read_connection(client):
                    client = self._replace_connection(client, None)
        finally:
            self._replace_connection(client, None)

    def _replace_connection(self, old: socket.socket | None, new: socket.socket | None) -> socket.socket | None:
        """Replace a connection; incomplete pieces are dropped."""
        if old is not None:
            old.close()
            self.stream.drop_partial()
            self._state = "ended" if self._count else "waiting"
        if new is not None:
            new.setblocking(False)
        return new

    def _call_sender(self) -> None:
        """Connect to a waiting sender, again and again."""
        while not self._stop.is_set():
            try:
                with socket.create_connection((LOOPBACK, self.port), timeout=_RECONNECT_SECONDS) as client:
                    client.setblocking(False)
                    self._reason = ""
                    while not self._stop.is_set():
                        if _is_readable(client) and not self._read_connection(client):
                            break
                self.stream.drop_partial()
                self._state = "ended" if self._count else "waiting"
            except OSError as error:
                self._reason = f"No sender answers: {error.strerror or error}"
            self._stop.wait(_RECONNECT_SECONDS)

    def _read_connection(self, client: socket.socket) -> bool:
        """Read the bytes of a connection; False if it has ended."""
        try:
            data = client.recv(_CHUNK)
        except BlockingIOError:
            return True
        except OSError:
            return False
        if data:
            self._add_bytes(data)
        return bool(data)

    def _add_bytes(self, data: bytes, whole: bool = False) -> None:
        """Parse bytes and store their frames; a flood of bytes is slowed down."""
        now = time.monotonic()
        if now - self._second_start >= 1.0:
            self._bytes_read, self._second_start = 0, now
        self._bytes_read += len(data)
        if self._bytes_read > _BYTES_PER_SECOND:  # slow down a sender that floods the port
            self._stop.wait(max(0.0, self._second_start + 1.0 - now))
        for frame in self.stream.feed(data, whole):
            with self._lock:
                self._count += 1
                if self._ring and frame.rows is not self._ring[-1].rows:
                    self._ring.clear()  # another skeleton: frames of the old one do not fit
                self._ring.append(StreamFrame(number=self._count, time=now, sent=_to_monotonic(frame.sent, now),
                                              values=frame.values, rows=frame.rows))
                while now - self._ring[0].time > self.seconds:
                    self._ring.popleft()
            self._state = "receiving"


def convert_poses(frames: list[StreamFrame]) -> tuple[Skeleton, np.ndarray, np.ndarray]:
    """Convert frames of one body to poses.

    Args:
        frames: T frames.
    Returns:
        skeleton: the body's skeleton.
        root: (T, 3) m, Z up.
        rotations: (T, J, 4) local rotations.
    """
    rows = frames[-1].rows
    return rows.skeleton, *rows.compute_poses(np.array([frame.values for frame in frames]))


def _compute_delay(frame: StreamFrame) -> float | None:
    """Compute the delay of a frame in s; None if it is unknown or the clocks do not agree."""
    delay = None if frame.sent is None else frame.time - frame.sent
    return delay if delay is not None and -0.01 <= delay <= 60.0 else None


def _to_monotonic(sent: float | None, now: float) -> float | None:
    """Convert seconds of the Unix clock to seconds of the monotonic clock."""
    return None if sent is None else sent - time.time() + now


def _is_readable(one: socket.socket) -> bool:
    """Whether a socket has data, after waiting _TICK at most."""
    return bool(select.select([one], [], [], _TICK)[0])


@atexit.register
def _stop_all() -> None:
    """Stop all listeners when the program exits."""
    for listener in list(_listeners):
        listener.stop()
