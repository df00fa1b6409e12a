"""The morning board of a fleet: which machines need a look, and the story of each."""

from thermaxis.board._board import (
    MOST_LINES as MOST_LINES,
    Line as Line,
    Need as Need,
    lines_of as lines_of,
)
from thermaxis.board._server import (
    PORT as PORT,
    board_application as board_application,
    board_settings as board_settings,
    serve_board as serve_board,
)
