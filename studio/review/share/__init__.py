"""Shared replays: a solve as one HTML file without external files, and links to such files.

bake.py     a solve as a small GLB
bundle.py   the page's modules and their imports as one block of text
page.py     the HTML file
store.py    the links on disk
"""
