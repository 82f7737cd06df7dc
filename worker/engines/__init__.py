"""Render engines. Today there is one: POV-Ray."""
