"""Reports as one HTML file each.

`svg` and `charts` draw, `body` is the body diagram, `page` the frame, `bootstrap` gives the intervals;
`evaluation` (with `evaluation_tables`) is the report of `evaluate`. The study's own page is in
`studio/lab/study/`.
"""
