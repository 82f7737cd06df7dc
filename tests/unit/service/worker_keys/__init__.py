"""Tests of worker keys."""
