"""Replays to give away: a solve as one HTML file that needs nothing else, and links to such files.

bake.py     a solve as a small GLB
bundle.py   the page's modules and their imports as one block of text
page.py     the HTML file
store.py    the links on disk
"""
