"""Observations of each camera: landmarks, the bodies that its network guesses, its rays and their errors."""
