"""Routes of the live stage: status and events, settings, performers, presets, live output, health."""
