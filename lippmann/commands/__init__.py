"""The sub-commands: options in, words out. What they need is imported when they run, so that help comes at once.

options  what several of them take
farm     up, demo, serve, worker
jobs     submit, jobs, show, watch, fetch, cancel, pause, resume, retry
scenes   scenes list, show, upload
keys     keys create, list, revoke, link
capture  capture
orthoscopic  orthoscopic
views    view, refocus
compare  compare
shown    jobs, scenes and keys as text
"""
