"""Work on takes without a live stage: `replay`, `tracking` of depth, `preview` of changed settings, `batch` of many
takes."""
