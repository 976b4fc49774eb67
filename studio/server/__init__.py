"""The server program: its configuration (`config`), its log (`logs`), its socket (`listening`), `start`, which loads
the code, and `run`, which joins all parts."""
