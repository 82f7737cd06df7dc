"""Starting a farm.

supervisor    the one-machine farm: a broker, the service and a worker that live and end together
serve         the service as a process
worker        the worker as a process
adapters      what the service needs from the worker's code
listening     the socket of the service
log_file      a log whose reader may go away
this_machine  what this machine has, and how to get what it lacks
demo          the demonstration: the integral video of the paper
"""
