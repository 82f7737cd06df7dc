"""The sandbox: everything foreign runs here, whatever the engine.

bundle    scene bundles: a folder or zip, checked, named by its content
detect    which sandbox holds on this machine, by trying
breakout  the program that tries to break out
sandbox   bubblewrap or Landlock
landlock  the launcher for Landlock
seccomp   the filter of system calls
own_user  a user of its own for the program of a worker that is root
devices   devices of a GPU, for a program that uses one
limits    CPU time, memory and file sizes, enforced by the kernel
groups    a cgroup for each task, where one was given to the worker
totals    files, memory and processes of a task together, counted while it runs
child     a child process that ends with its parent
process   runs a child to its end, with a progress reader of the engine
ending    why and when a child must end
output    its output in lines: for the reader of progress, the log and a diagnosis
conversation   a child that stays and answers requests
results   what is taken out of the sandbox
log       the log of one attempt
"""
