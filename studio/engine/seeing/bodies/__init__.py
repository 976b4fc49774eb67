"""Several bodies in one image: the owner of each cell, and people who share a cluster."""
