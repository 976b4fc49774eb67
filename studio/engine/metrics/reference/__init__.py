"""The reference: its reader, its canonical joints, and the alignment of solve and reference in place and time."""
