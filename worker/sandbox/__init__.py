"""The sandbox: everything foreign runs here, whatever the engine.

bundle    scene bundles: a folder or zip, checked, named by its content
sandbox   bubblewrap or Landlock
landlock  the launcher for Landlock
limits    CPU time, memory and file sizes, enforced by the kernel
child     a child process that ends with its parent
process   runs a child to its end, with a progress reader of the engine
log       the log of one attempt
"""
