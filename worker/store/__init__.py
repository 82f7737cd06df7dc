"""Artifact stores: implementations of `lippmann.plan.artifact_store.ArtifactStore`.

names      which names an artifact may have
copies     copies of the artifacts of a bucket, on this machine
local      a folder on this machine, or on a disk that all machines share
opening    opens the store that the settings name
owner      the owner of the files of a store
s3         a bucket of an S3 server
s3_clients clients of an S3 server, and of the URLs that it signs
s3_errors  errors of an S3 server, translated
"""
