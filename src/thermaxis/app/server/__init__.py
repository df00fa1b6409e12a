"""The server that puts the rooms of the app together."""

from thermaxis.app.server._server import serve_app as serve_app
