"""Settings of libraries, of `mirror` and `retarget`, and the preferences."""
# fmt: off

from pathlib import Path

from .setting import POSITIVE, Setting

TABLES = {
    "library": (
        Setting(name="cache", kind=Path, option="--cache", metavar="DIR", help="folder of the library's cache"),
        Setting(name="skeleton", kind=Path, option="--skeleton", metavar="CLIP.bvh", help="clip with the library's "
                "skeleton"),
        Setting(name="unit", kind=float, option="--unit", help="metres per unit of the BVH files",
                identifier="library_unit", title="Metres per Unit", tooltip="Size of one unit of the clips in metres; "
                "0 guesses it from the height of the hips", precision=5, **POSITIVE,
                panel_more=dict(default=0.0, min=0.0, max=None)),
        Setting(name="watch", default=False, identifier="library_watch", title="Watch Folder",
                tooltip="Check the folder every few seconds for new or changed clips and labels, and show a message; "
                "nothing is built automatically"),
    ),
    "library.build": (Setting(name="rebuild", default=False, option="--rebuild", help="ignore the cache"),),
    "library.learn": (Setting(name="least", default=0.5, least=0.0, most=1.0, expected="a number from {least} to "
                              "{most}", option="--least",
                              help="lowest confidence of a proposal (default %(default)g)"),),
    "mirror": (Setting(name="unit", kind=float, option="--unit", help="metres per unit of IN.bvh", **POSITIVE),),
    "retarget": (
        Setting(name="unit", kind=float, option="--unit", help="metres per unit of IN.bvh", **POSITIVE),
        Setting(name="to_unit", kind=float, option="--to-unit", help="metres per unit of SKELETON.bvh", **POSITIVE),
        Setting(name="stature", kind=float, least=1.0, most=2.4, unit="metres", option="--stature",
                help="height of the person of IN.npz; default: the one that the steps fit"),
        Setting(name="body_model", kind=Path, option="--body-model", metavar="MODEL.npz",
                help="body model of SMPL's family, for the bones of the person of IN.npz"),
    ),
    "preferences": (
        Setting(name="cache_folder", default="", tooltip="Folder for built libraries, each in its own folder; "
                "empty stores them beside the recordings, in a folder .beyond_mocap",
                panel_more=dict(subtype="DIR_PATH")),
        Setting(name="threads", default=0, least=0, most=256, tooltip="Number of recordings read at once when a "
                "library is built; 0 uses all processor cores. A synthesis uses one, so that the "
                "same input always gives the same motion"),
    ),
}
