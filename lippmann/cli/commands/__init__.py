"""The sub-commands: options in, words out. What they need is imported when they run, so that help comes at once.

options  what several of them take
farm     up, demo, serve, worker
jobs     submit, jobs, show, watch, fetch, cancel, pause, resume, retry
scenes   scenes list, show, upload
keys     keys create, list, revoke, link
design   design
lens     lens
capture  capture
foreign  views
orthoscopic  orthoscopic
views    view, refocus
depth    depth
observe  observe
export   export
calibration  calibration-sheet
compare  compare
coding_study  coding-study
paper    paper
shown    jobs, scenes and keys as text; likewise shown_design, shown_lens, shown_compare
"""
