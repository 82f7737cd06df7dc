"""The dashboard without a browser: what it sends, to whom, and under which policy."""
