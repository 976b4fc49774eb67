"""Access control of a studio that is open to the network: operators sign in, cameras pair with tokens.

On a loopback address nobody needs to sign in. `tokens` keeps the tokens, `guard` checks every request, `routes` has
signing in and out and the pairing of cameras. The guard passes the camera link, whose token comes with `Hello`.
"""

from studio.api.access.guard import AccessGuard
from studio.api.access.routes import access_router
from studio.api.access.tokens import Access

__all__ = ["Access", "AccessGuard", "access_router"]
