"""The performers on the live stage: their names, who is whom, which camera sees them, and their status."""
