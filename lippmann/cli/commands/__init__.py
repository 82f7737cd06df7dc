"""The sub-commands: each reads its options and prints its result.

A sub-command imports what it needs when it runs, so that `--help` stays fast.

farms/      those who run a farm: up, serve, worker, workers, top, keys, backup, doctor
client/     those who use one: submit, jobs, watch, fetch, scenes, and the actions on jobs
images/     integral images on disk: import, orthoscopic, view, refocus, observe, depth, export, compare
design      design, calibration-sheet
lens        lens
preview     preview
docs        docs
paper       paper
"""
