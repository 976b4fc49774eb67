"""Animation in and out (step 12).

`motion` is known human motion, `read` reads foreign files, `clip` turns a solve into local keys, `curves` reduces and
fits keys for editing, `mannequin` is the body, `export` writes files, `retarget` writes onto a user's own rig.
"""
