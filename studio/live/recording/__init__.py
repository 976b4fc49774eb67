"""Recording of a take."""
