"""Hand states from depth: open or closed, by the thesis's circles and by the hand's shape."""
