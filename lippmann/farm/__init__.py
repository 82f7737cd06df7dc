"""Starting a farm.

supervisor       the one-machine farm: a broker, the service and a worker that live and end together
serve            the service as a process
worker           the worker as a process
adapters         what the service needs from the worker's code
listening        the socket of the service
log_file         a log whose reader may go away
this_machine     what this machine has, and how to get what it lacks
browser_door     the login link of the browser that `--open` opens, on no command line
browser_starter  a process that starts that browser outside the farm, whose end it outlives
demo             the demonstration: the integral video of the paper
"""
