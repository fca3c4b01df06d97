"""The list of what the older Blender leaves out is of tests that there are."""

from conftest import COLLECTED, HERE, read_left_out


def test_each_test_on_the_list_exists(request):
    """Of the files that this run was given, or that are gone: one that was renamed would run in both, unnoticed."""
    there = request.config.stash[COLLECTED]
    files = {name.partition("::")[0] for name in there}
    missing = {name: name.partition("::")[0] for name in read_left_out() - there}
    gone = sorted(name for name, file in missing.items() if file in files or not (HERE / file).is_file())
    assert not gone, f"take these out of left_out.txt, or choose again with make left-out: {gone}"
