"""Beyond Mocap's core: from dots, a folder of motion capture and a few words to moving bodies.

The way through is `import -> library -> annotate -> synthesize -> polish -> bake`, and the rooms stand in that order:

- `motion`      what a movement is: quaternions, skeletons, motions, tracks, contacts, mirroring
- `markers`     from optical markers to a skeleton
- `files`       what enters or leaves by disk, converted once at the border
- `annotation`  the shared language: vocabulary, timelines, their text form
- `library`     what we choose from: clips, words, features, clusters
- `plan`, `take` what is asked and what came out
- `synthesis`   how we choose: blocks of frames, dynamic programming, costs
- `synthesis`   plan, search, construction and edits
- `evaluation`  how good it is: every figure of the report
- `synthesize`  the recipe that walks through all rooms once

Units and frames everywhere inside: metres, seconds, radians; Z up, X forward along the pitch's length, Y to its left;
quaternions (w, x, y, z), unit and sign-continuous; arrays (frame, joint, component) with free leading axes.
Readers and writers convert at the border. Inputs are never changed; randomness takes a seed; the same input gives the
same output. The core needs numpy, scipy and scikit-learn, and never bpy.
"""

__version__ = "0.1.0"
