"""Placement of cameras by the body and the floor that they see."""
