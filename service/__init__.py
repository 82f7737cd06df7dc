"""Asks, shows, remembers: the HTTP service, its database and the clerk that keeps jobs going.

main          create_app(), Server
routes        HTTP only: parse, call jobs, shape the answer
dashboard     pages and static files
dependencies  what a route asks for: session, settings, caller
jobs          the use cases
queue         Celery, only here, by task name
stream        Redis: events, presence, stop keys
db            engine, tables, migrations, named queries
schemas       what the API says
settings      what the environment sets
parts         what is handed in: artifact store, pictures, scenes
errors        what can go wrong, and the table of answers
openapi       the contract as a file: `python -m service.openapi` writes it
"""
