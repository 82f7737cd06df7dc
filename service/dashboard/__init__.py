"""The dashboard: one page, its static files, and the page that asks for a key. Nothing is built.

assets   static files, named by what they hold
policy   what a page may load
pages    the two pages and the router

In `templates/` lie the two documents. In `static/`:

app       starts the page; login does so for the page that asks for a key
api       HTTP, only here
live      keeps what the page knows true; store holds it
header    the farm's health; jobs: the list
job       one job, with rig, videos, frames and failures
lightbox  a frame large: still, as it is; looking, looked into; foot and choice for both
looks     the ways of looking: painting, by painter, shaders and views; fetched, by answer
submit    a new job, with field and parameters
design    what a job will give
format    words for numbers; html: the markup
vendor/   what others wrote
"""

from service.dashboard.pages import router

__all__ = ["router"]
