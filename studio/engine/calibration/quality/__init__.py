"""Quality of a calibration, at first and over time: residuals, halves, verdicts, moved cameras."""
