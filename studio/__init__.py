"""Capture Studio."""
