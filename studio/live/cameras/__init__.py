"""The cameras of the live stage: presence, clocks, links and previews."""
