"""The rigid bodies of a take: motion and descriptions (`kept`), and their use in solves and exports (`used`)."""
