"""Red-team tests: programs that do their worst inside the real sandboxes, and leave nothing."""
