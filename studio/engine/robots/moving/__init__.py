"""A performer's motion on a robot: scaled to it, and solved as a whole take, live, or frame by frame."""
