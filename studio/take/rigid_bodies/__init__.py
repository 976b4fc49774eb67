"""The rigid bodies of a take: their motion (`kept`), what they are, and their use in solves and exports (`used`)."""
