"""`make demo` ends with one line on Ctrl-C, and with its own last line else."""

import os
import pathlib
import subprocess
import sys

SAMPLES = pathlib.Path(__file__).parents[3] / "sample_blend"
INTERRUPTED = """
import demo, os, signal
folder = demo.create_temporary_folder()
open(os.path.join(folder, "picture.png"), "w").close()
demo.handle_interrupt()
os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # as where Blender is silenced
try:
    os.kill(os.getpid(), signal.SIGINT)
except BaseException:
    pass  # as Blender's handlers do
print("goes on")
"""


def test_ctrl_c_ends_it_with_one_line_also_inside_of_blenders_handlers_and_leaves_nothing(tmp_path):
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], cwd=SAMPLES, capture_output=True, text=True,
                          env=os.environ | {"TMPDIR": str(tmp_path)})
    assert (done.returncode, done.stdout, done.stderr.split("\n")) == (130, "", ["", "demo: cancelled", ""])
    assert list(tmp_path.iterdir()) == []


def test_the_end_has_no_message_of_what_runs_at_exit():
    script = "import atexit, demo; atexit.register(print, 'Error'); print('Finished'); demo.end_process(0)"
    done = subprocess.run([sys.executable, "-c", script], cwd=SAMPLES, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "Finished\n", "")
