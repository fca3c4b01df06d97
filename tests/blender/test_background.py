"""Work in a thread: it ends, it can be cancelled, and what nobody waits for any more is dropped."""

import importlib
import threading
import time

import pytest


@pytest.fixture
def background(extension):
    return importlib.import_module(f"{extension.__name__}.scene.background")


def wait(job):
    """Poll as a timer would."""
    for _ in range(500):
        if job.poll():
            return
        time.sleep(0.01)
    raise AssertionError("the job did not end")


def test_result_and_progress(background):
    def work(progress, cancelled):
        progress(0.5, "half")
        return threading.current_thread() is not threading.main_thread()

    job = background.Job("test", work)
    wait(job)
    assert job.result is True and (job.fraction, job.text) == (0.5, "half") and not job.stale


def test_errors_are_carried_over(background):
    def work(progress, cancelled):
        raise ValueError("planted")

    job = background.Job("test", work)
    wait(job)
    assert isinstance(job.error, ValueError) and not background.cancelled(job)


def test_cancel_reaches_the_work(background, core):
    def work(progress, cancelled):
        while not cancelled():
            time.sleep(0.005)
        raise core("errors").Cancelled("stopped")

    job = background.Job("test", work)
    background.stop("another kind")
    assert not job.stale
    background.stop("test")
    wait(job)
    assert job.stale and background.cancelled(job)


def test_a_newer_job_makes_the_older_one_stale(background):
    held = threading.Event()
    old = background.Job("test", lambda progress, cancelled: held.wait(5))
    other = background.Job("another", lambda progress, cancelled: 0)
    new = background.Job("test", lambda progress, cancelled: 2)
    held.set()
    for job in (old, other, new):
        wait(job)
    assert old.stale and not new.stale and not other.stale
