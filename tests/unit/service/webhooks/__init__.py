"""Tests of `service.webhooks`."""
