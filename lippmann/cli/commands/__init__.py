"""The sub-commands: each reads its options and prints its result.

A sub-command imports what it needs when it runs, so that `--help` stays fast.

farm           up, demo, serve, worker, status, workers
keys           keys create, list, revoke, link, webhook-secret, audit
doctor         doctor
jobs           submit, jobs, show, tasks, logs, watch
files          fetch, link
job_actions    cancel, pause, resume, retry, repair, skip, priority, rm
scenes         scenes list, show, upload, rm; capture
import_sheets  import
orthoscopic    orthoscopic
views          view, refocus
observe        observe
depth          depth
export         export
compare        compare
coding_study   coding-study
design         design, calibration-sheet
lens           lens
paper          paper
"""
