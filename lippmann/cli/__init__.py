"""The command `lippmann`.

main           the entry point: sub-commands, errors and exit codes
options        options that several sub-commands share, and the context of a command
option_values  option values that are lists of numbers or descriptions of lenses
engines        the engines of this machine
several        one action on several jobs or scenes
commands       one module for each group of sub-commands
text           results as text for people
exit_codes     which error ends the command with which exit code
"""
