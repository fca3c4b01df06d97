"""Work in a thread: it ends, it can be cancelled, and what nobody waits for any more is dropped."""

import importlib
import threading
import time

import pytest


@pytest.fixture
def background(extension):
    return importlib.import_module(f"{extension.__name__}.scene.core.background")


def wait(job):
    """Poll as a timer would."""
    for _ in range(500):
        if job.poll():
            return
        time.sleep(0.01)
    raise AssertionError("the job did not end")


def test_result_and_progress(background):
    def work(progress, cancelled, hurry):
        progress(0.5, "half")
        return threading.current_thread() is not threading.main_thread()

    job = background.Job("test", work)
    wait(job)
    assert job.result is True and (job.fraction, job.text) == (0.5, "half") and not job.is_stale


def test_progress_always_has_a_text(background):
    """Before the thread had said anything, the panel showed a player's name with nothing behind it."""
    job = background.Job("test", lambda *asking: None)
    assert job.describe_progress() == "Starting 0 %"
    wait(job)
    job = background.Job("test", lambda progress, *asking: progress(0.41, "searching"))
    wait(job)
    assert job.describe_progress() == "Searching 41 %"


def test_errors_are_carried_over(background):
    def work(progress, cancelled, hurry):
        raise ValueError("planted")

    job = background.Job("test", work)
    wait(job)
    assert isinstance(job.error, ValueError) and not background.is_cancelled(job)


def test_cancel_reaches_the_work(background, core):
    def work(progress, cancelled, hurry):
        while not cancelled():
            time.sleep(0.005)
        raise core("base.errors").UserCancelledError("stopped")

    job = background.Job("test", work)
    background.cancel_jobs("another kind")
    assert not job.is_stale
    background.cancel_jobs("test")
    wait(job)
    assert job.is_stale and background.is_cancelled(job)


def test_what_keeps_its_results_ends_early_when_asked_and_is_cancelled_when_asked_again(background, core):
    def patient(progress, cancelled, hurry):
        while not hurry():
            time.sleep(0.005)
        return "half"

    def stubborn(progress, cancelled, hurry):
        while not cancelled():
            time.sleep(0.005)
        raise core("base.errors").UserCancelledError("stopped")

    job = background.Job("test", patient, can_end_early=True)
    background.end_jobs()
    wait(job)
    assert job.is_ending and not job.is_stale and job.result == "half"
    again = background.Job("test", stubborn, can_end_early=True)
    background.end_jobs()
    assert again.is_ending and not again.is_stale
    background.end_jobs()
    wait(again)
    assert background.is_cancelled(again)
    keeps_nothing = background.Job("test", stubborn)
    background.end_jobs()
    wait(keeps_nothing)
    assert background.is_cancelled(keeps_nothing)


def test_a_newer_job_makes_the_older_one_stale(background):
    held = threading.Event()
    old = background.Job("test", lambda *asking: held.wait(5))
    other = background.Job("another", lambda *asking: 0)
    new = background.Job("test", lambda *asking: 2)
    held.set()
    for job in (old, other, new):
        wait(job)
    assert old.is_stale and not new.is_stale and not other.is_stale
