"""Results of a calibration, their quality, and refusals."""
