"""The figures, one concept per file."""
