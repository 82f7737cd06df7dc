"""The output of commands: progress, tables, and results as text or JSON.

The package stands below the command line because `client`, `local` and `farm` report progress too, and none of them
may import `cli`.

extras    how to install an optional package
output    the result on stdout, notes on stderr
progress  progress bars, durations and sizes as text
table     columns of text
"""
