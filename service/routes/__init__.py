"""HTTP only: each route parses a request, calls the rules, and presents the result.

health      the health of the farm
workers     the workers that are online
farm        the work of the farm now and in the last hours
scenes      the scenes that jobs can use
design      the design of a job file
schemas     the JSON schemas of the job file and of a design
jobs        submit, list, get, change, cancel, pause, resume, retry and remove jobs
tasks       tasks, their logs, and frames
viewing     views of a frame on demand
artifacts   files of a job, whole and in part
outputs     outputs of a job with all their files in one zip
events      the stream of server-sent events
keys        keys, usage, login links, browser sessions and the audit log
login       login and logout of browsers
openid      login with an account of an OpenID provider
middleware  path prefix, request ids, rates, and the limit of the request size
description the statuses and the keys of each operation, for the OpenAPI description
problems    errors as problem details
"""
