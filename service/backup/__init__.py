"""Backup and restore of a farm: its database in a portable form, and the artifacts of its jobs.

manifest   what a backup holds, with counts and digests
files      files and folders that are complete or absent, and digests
rows       the tables as compressed JSON lines, from and into SQLite and PostgreSQL
artifacts  the artifacts as files, linked or copied
write      writes a backup of a living farm
reset      the rows that refer to running processes, which do not survive a restore
restore    checks a backup and restores it into an empty farm
"""
