"""Known human motion: BVH files and the authored performer, as paths of the canonical joints."""
