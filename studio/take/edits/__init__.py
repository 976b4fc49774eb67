"""The edits of a take on disk: `edits.json` (`kept`), its changes with undo and redo (`change`), the check of
whether they are allowed (`check`), and edits made under another calibration (`carry`).
"""
