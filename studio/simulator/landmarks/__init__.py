"""Landmarks in pictures with a pose network's errors: `body` places them, `tracker` adds the errors."""
