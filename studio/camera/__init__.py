"""The camera client: sources of frames, devices, simulated cameras, and the link to the server."""
