"""What each camera saw: landmarks, the bodies that its network guesses, its rays and their errors."""
