"""Point clouds of the 3D view: depth images, live and replayed, thinned to a budget and placed on the stage."""
