"""First clocks and places of the cameras, from the guessed bodies."""
