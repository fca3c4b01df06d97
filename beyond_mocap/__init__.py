"""Beyond Mocap's core: from tracking data, a folder of motion capture and a few labels to full-body animation.

A folder for each feature over a small shared base; docs/architecture.md has the rooms, what each is for and who may
import whom. The main road: `files` and `library` in, `synthesis` (plan, resolve, search, construct), `evaluation` out.

Units and frames everywhere inside: metres, seconds, radians; Z up, X forward along the pitch's length, Y to its left;
quaternions (w, x, y, z), unit and sign-continuous; arrays (frame, joint, component) with free leading axes.
Readers and writers convert at the border. Inputs are never changed; randomness takes a seed; the same input gives the
same output. The core needs numpy, scipy and scikit-learn, and never bpy.
"""

__version__ = "0.1.0"
