from ._lock import (
    file_lock as file_lock,
    held_lock as held_lock,
    sole_runner as sole_runner,
)
from ._loopback import (
    is_loopback as is_loopback,
    parsed_address as parsed_address,
)
from ._private_files import (
    read_limited as read_limited,
    read_private as read_private,
    read_secret as read_secret,
    refuse_readable as refuse_readable,
    unreadable as unreadable,
    whole_file as whole_file,
)
from ._request_socket import (
    ASKED_HERE as ASKED_HERE,
    LocalAnswer as LocalAnswer,
    RequestSocket as RequestSocket,
    ask_loop as ask_loop,
)
from ._tls import (
    server_context as server_context,
)
