"""Programs that do their worst inside the real sandboxes and leave nothing, and hostile texts, bundles and requests."""
