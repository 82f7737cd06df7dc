"""The capture geometry: bench, microlens array, camera, display and the exact rays of every pixel."""
