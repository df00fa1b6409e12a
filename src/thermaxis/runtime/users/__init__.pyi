from ._throttle import (
    FAILURES_BY_ADDRESS as FAILURES_BY_ADDRESS,
    FAILURES_BY_NAME as FAILURES_BY_NAME,
    PIN_REFUSED_S as PIN_REFUSED_S,
    REFUSED_S as REFUSED_S,
    LogInThrottle as LogInThrottle,
)
from ._tokens import (
    TOKEN_S as TOKEN_S,
)
from ._users import (
    ANONYMOUS as ANONYMOUS,
    LONGEST_NAME as LONGEST_NAME,
    LONGEST_PASSWORD as LONGEST_PASSWORD,
    PIN_MARK as PIN_MARK,
    Identity as Identity,
    Role as Role,
    User as User,
    Users as Users,
    check_name as check_name,
    hash_password as hash_password,
    hash_pin as hash_pin,
    read_users as read_users,
    write_users as write_users,
)
