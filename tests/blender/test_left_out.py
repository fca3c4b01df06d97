"""The list of what the older Blender leaves out is of tests that there are."""

from conftest import COLLECTED, read_left_out


def test_each_test_on_the_list_exists(request):
    """Of the files that this run was given. One that was renamed would run in both Blenders, unnoticed."""
    there = request.config.stash[COLLECTED]
    files = {name.partition("::")[0] for name in there}
    gone = sorted(name for name in read_left_out() - there if name.partition("::")[0] in files)
    assert not gone, f"take these out of left_out.txt, or choose again with make left-out: {gone}"
