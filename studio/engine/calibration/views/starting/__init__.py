"""First clocks and places of the cameras, by the guessed bodies."""
