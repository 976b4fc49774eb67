"""Commands of a stage: the server and its configuration, certificate, cameras, checks and compiled functions."""
