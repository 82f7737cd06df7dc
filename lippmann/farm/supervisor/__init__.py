"""The one-machine farm: a broker, the service and a worker that live and end together.

farm         starts a supervisor, receives its events and stops it
plan         what a farm is: folder, address, slots
__main__     the supervisor as a process
supervisor   starts the children in order, restarts them, stops them
children     the command lines of the three children
child        one child: its process, its log, its pauses
broker       the Valkey or Redis server: its program, socket and command line
logs         the bounded log of a child
descendants  the processes below this one, which must not outlive it
folder       the data folder: it is writable, has free space, and belongs to one farm

Three mechanisms keep a farm from leaving processes behind. The kernel kills every child when its parent dies. The
supervisor sees the end of the process that started it, because its stdin closes, and it adopts and kills orphaned
processes. The process that started the supervisor does the same for the supervisor.
"""
