"""Takes on disk: a folder with what was recorded (`raw`), where it lies (`take`), imports, lists, doctor.

`take` is the folder and its `take.json`; `names` keeps every path inside it; `raw` writes `raw.mcap` and
`raw_reader` reads it, damaged or not; `importers` makes takes of other recordings; `sessions` lists takes;
`doctor` finds and repairs what a crash left; `install` checks the program itself.
"""
