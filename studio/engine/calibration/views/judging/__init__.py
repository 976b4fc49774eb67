"""What a calibration gives, how good it is, and what is refused."""
