"""From depth images to points: grids with normals, clusters, the floor, and free space."""
