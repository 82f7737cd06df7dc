"""Events for listeners: publishing, the server-sent event stream, and waking up."""
