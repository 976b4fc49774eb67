"""Time (step 3): camera clocks, aligned frames, and the schedule of output frames."""
