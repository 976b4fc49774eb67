"""The reference: its reader, its canonical joints, and its alignment with a solve in space and time."""
