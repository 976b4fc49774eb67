"""FBX 7400, binary: `writer` writes a file from records, curves, skeleton and mesh."""
