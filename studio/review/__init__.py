"""Review and sharing of solves: pictures, reports, blind tests, shared replays."""
