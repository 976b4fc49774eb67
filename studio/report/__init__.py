"""Reports as one HTML file each: `svg` and `charts` draw, `body` the body diagram, `page` is the frame, `bootstrap` the
intervals; `evaluation` is the report of `evaluate`, the study's own pages are in `studio/study/`.
"""
