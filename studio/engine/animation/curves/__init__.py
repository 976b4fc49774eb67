"""Keys of animation curves: continuous Euler angles, slopes, and key reduction."""
