"""Routes that other people reach by a link: blind tests and shared replays."""
