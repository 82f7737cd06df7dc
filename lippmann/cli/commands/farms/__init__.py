"""The commands of those who run a farm.

farm           up, demo, serve, worker, status
workers        workers: list, drain, exclude, forgive
top            top
keys           keys create, list, revoke, link, webhook-secret, audit
backup         backup, restore, upgrade
doctor         doctor
"""
