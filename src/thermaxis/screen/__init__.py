"""The operator's and the engineer's pages: what the loop says, and what people ask of it.

A process of its own. It reads the loop's status server, the history and the model's file, and
hands requests to the status server under the name of whoever has logged in; it can do nothing
else, and the loop does not notice whether it lives.
"""

from thermaxis.screen._server import serve as serve, serve_pages as serve_pages
