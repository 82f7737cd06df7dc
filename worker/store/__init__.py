"""Artifact stores: implementations of `lippmann.plan.artifact_store.ArtifactStore`.

names      which names an artifact may have
local      a folder on this machine, or on a disk that all machines share
opening    opens the store that the settings name
s3         a bucket of an S3 server
s3_errors  errors of an S3 server, translated
"""
