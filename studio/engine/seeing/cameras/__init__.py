"""Cameras placed by the body and the floor that they see."""
