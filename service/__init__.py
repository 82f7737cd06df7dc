"""The HTTP API and the coordinator. They run in one process, with one database.

main           the application and its server
routes         HTTP only: parse, call, present
dashboard      web pages and static files
dependencies   the dependencies of routes: state of the application, session, caller
coordinator    the threads that schedule tasks, record events and repair rows
api            what the API answers with: presenters, listings, artifact files
viewing        views of a frame on demand
previews       previews of jobs, which workers render at once
webhooks       signed messages to the URLs that jobs name, when the jobs have ended
jobs           the rules of jobs: submission, state machine, planning, commands, completion, repair
scenes         the scenes that jobs can use
health         health checks
auth           keys, login links and browser sessions
artifact_links signed links to artifacts
events         events for subscribers, and the stream of server-sent events
order_queue    the queue of orders to workers, by Celery
broker_stream  worker events, presence and stop signals, in Redis
connections    deadlines and caps of connections, before login
query_names    the parameters that a route takes in its query
rate_limits    rates of requests by key and address
claiming       which workers take orders
roster         the workers that are online, as requests know them
db             the database: engine, tables, migrations, queries
ids            the ids of jobs, tasks and attempts
schemas        the schemas of the API
settings       the settings from the environment
ports          the interfaces that the service needs and does not implement
errors         the errors, and the table of HTTP statuses
openapi        the API contract as a file: `python -m service.openapi` writes it
"""
