"""Starting a farm: the one-machine supervisor, the service and worker processes, and the demo."""
