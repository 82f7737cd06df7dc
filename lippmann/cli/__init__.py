"""The command `lippmann`.

main         the entry point: sub-commands, errors and exit codes
commands     one module for each group of sub-commands
options      options that several sub-commands share
text         results as text for people
exit_codes   which error ends the command with which exit code
"""
