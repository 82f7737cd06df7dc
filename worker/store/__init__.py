"""Artifact stores: implementations of `lippmann.plan.artifact_store.ArtifactStore`.

names      which names an artifact may have
local      a folder on this machine, or on a disk that all machines share
"""
