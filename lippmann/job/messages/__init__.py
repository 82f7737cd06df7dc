"""The messages between the service and the workers.

orders   what the service sends to a worker: one attempt of one task
events   what a worker reports: the events of an attempt, and the presence of the worker
previews  the order of a preview, and the answer to it
seals    the signatures of all these messages, which are encoded and decoded there
worker_keys  the keys of single workers, which sign what these workers report
wire     the names of queues, streams and keys on Redis, and the intervals that both sides rely on
"""
