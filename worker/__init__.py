"""Turn planned orders into pictures and video.

tasks      decode an order, call, report; outputs/ has the makers of all kinds of output
app        the Celery application of a worker
consumer   takes orders from the broker, proves that it polls, connects again
liveness   the signs of life of a worker, which its consumer gives
preview_process  the process that renders previews, beside the slots
settings   the settings of a worker, from the environment
untrusted  pictures of other programs, decoded in the sandbox
engines    the renderers, POV-Ray and Mitsuba, behind one protocol
sandbox    child processes, their limits and what holds them: everything foreign runs here
images     pictures as files, by OpenImageIO
video      videos as files, by PyAV
exports    file formats of print shops and of research
store      artifacts
report     leases, events and presence on Redis
preview_orders  the orders of previews for one worker, and its answers
whole_file files that are written completely or removed

The library below, without input or output, is `lippmann.{lattice, lightfield, optics, job, plan}`.
"""
