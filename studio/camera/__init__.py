"""The camera client: sources of frames, the simulator, and the link to the server."""
