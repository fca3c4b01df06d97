"""Beyond Mocap's core: full-body animation from tracking data, a folder of motion capture and a few labels.

There is one folder per feature over a small shared base; docs/explanation/architecture.md describes each folder and
which folders it may import. The main sequence is `files` and `library` (input), `synthesis` (plan, resolve, search,
construct) and `evaluation` (output).

Units and frames inside the core: metres, seconds, radians; Z up, X forward along the pitch's length, Y to its left;
quaternions (w, x, y, z), unit and sign-continuous; arrays (frame, joint, component) with free leading axes.
Readers and writers convert at the border. Functions do not change their inputs. Randomness takes a seed, and the same
input gives the same output. The core needs numpy, scipy and threadpoolctl, and never bpy; `base.optional_packages`
names what single tasks need.
"""

__version__ = "0.2.0"
