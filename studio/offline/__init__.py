"""Work on takes without a live stage: `replay`, `tracking` of depth, `preview` of changed settings, what `edits` lead
to, `batch` of many takes."""
