"""Images of a simulated depth camera: room, exact image, and the noise of real sensors."""
