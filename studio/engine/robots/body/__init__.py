"""A robot as a body: reads its model, finds its parts, and measures them."""
