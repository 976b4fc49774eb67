"""Commands of characters: a user's rigs, and humanoid robots."""
