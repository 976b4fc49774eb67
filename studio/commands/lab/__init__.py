"""Commands of the lab: the speed of this machine, and the thesis's experiments."""
