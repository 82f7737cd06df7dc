"""Events for subscribers.

payloads      the data of events, built from rows
publish       stores an event in the transaction that makes the change
wakeup        wakes the coordinator and the event hub after a change
sse           the text of server-sent events
subscription  the queue of one client
hub           distributes the stored events to all clients of the process
"""
