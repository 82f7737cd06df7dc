"""One attempt at a task, and where it works.

attempt     acquire the lease, work, report
workplace   store, scratch folders, sandbox, the log of an attempt
artifacts   what an attempt reads, verified, and what it stores, with digests
monitor     progress monitors
live_log    the log in the store while the attempt runs
lost        the end of a pool process that died, reported by its worker
sweep       what killed attempts left in the scratch folder, removed
"""
