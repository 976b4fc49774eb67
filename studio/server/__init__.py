"""The server program: its configuration (`config`), its log (`logs`), and `run`, which joins all parts."""
