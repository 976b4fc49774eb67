"""Errors, files, arrays, rotations and compilation: the lowest wing of the engine. It knows nothing of motion."""
