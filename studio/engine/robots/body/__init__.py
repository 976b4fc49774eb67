"""A robot as a body: its model read, its parts found, and measured."""
