"""What the HTTP API returns: presenters, listings and artifact files."""
