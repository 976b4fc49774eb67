"""Who may do what when the studio is opened to the network: operators sign in, cameras pair with tokens.

On a loopback address nothing is asked. `tokens` keeps the tokens, `guard` stands before every route, `routes` signs
in and out and pairs cameras. The camera link is open to the guard: its token comes with `Hello`.
"""

from studio.api.access.guard import AccessGuard
from studio.api.access.routes import access_router
from studio.api.access.tokens import Access

__all__ = ["Access", "AccessGuard", "access_router"]
