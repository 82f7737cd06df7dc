"""The sub-commands: each reads its options and prints its result.

A sub-command imports what it needs when it runs, so that `--help` stays fast.

farm           up, demo, serve, worker
keys           keys create, list, revoke, link, webhook-secret, audit
jobs           submit, jobs, show, watch, fetch, link, cancel, pause, resume, retry, repair
scenes         scenes list, show, upload; capture
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
