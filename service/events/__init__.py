"""Events for subscribers.

payloads   the data of events, built from rows
publish    stores an event in the transaction that makes the change
sse        the stream of server-sent events
wakeup     wakes the coordinator and the streams after a change
"""
