"""A camera client that waits for a studio: it is announced on the network, and a click connects it.

The person who clicks must know the code that the client shows (docs/decisions/0042-cameras-by-a-click.md).
"""
