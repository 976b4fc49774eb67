"""Training of the small networks for hands and heads, on simulated images."""
