"""Several bodies in one image: whose each cell is, who stands within one cluster, and who is new."""
