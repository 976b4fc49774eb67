"""Cameras of the server: their link, cameras of this machine, recordings played as cameras, and invitations for
others."""
