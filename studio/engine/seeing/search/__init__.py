"""Recovery of a body: cold starts, lost limbs, and front and back."""
