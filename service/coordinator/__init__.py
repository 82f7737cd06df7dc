"""The background threads of the service that keep jobs going."""
