"""The edits of a take on disk: `edits.json` (`kept`), its changes with undo and redo (`change`), what is allowed
(`check`), and edits that were made under another calibration (`carry`).
"""
