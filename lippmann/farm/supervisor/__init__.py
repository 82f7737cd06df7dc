"""The one-machine farm: a broker, the service and a worker that live and end together.

farm      the farm as others use it: starts a keeper, hears from it, ends it
plan      what a farm is: folder, address, slots
__main__  the keeper as a process of its own
keeper    starts the children in order, starts them anew, ends them
children  the command lines of the three
child     one child: its process, its log, its pauses
broker    where a Valkey or Redis server is, and how it is told
logs      a child's log, bounded
kin       processes below this one: none outlives it
folder    the data folder: can be written, has room, one farm only

Three things keep a farm from leaving anything behind. The kernel kills every child when its parent dies. The keeper
hears the end of whoever started it (its stdin closes), and adopts and kills whatever lost its parent. Who started it
does the same for the keeper.
"""
