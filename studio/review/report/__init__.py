"""Reports as one HTML file each.

`svg` and `charts` draw, `body_diagram` draws errors on a body, `page` is the frame, `bootstrap` gives the intervals;
`evaluation` (with `evaluation_tables`) is the report of `evaluate`. The study's own page is in `studio/lab/study/`.
"""
