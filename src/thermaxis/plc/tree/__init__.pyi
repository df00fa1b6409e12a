from ._check import (
    BLOCK_PREFIX as BLOCK_PREFIX,
    LONGEST_ARRAY as LONGEST_ARRAY,
    check_program as check_program,
)
from ._execute import (
    Executed as Executed,
    executable as executable,
    rounding as rounding,
    to_single as to_single,
)
from ._names import (
    REMARK as REMARK,
    RESERVED as RESERVED,
    PlcNames as PlcNames,
    is_legal as is_legal,
    legal_stem as legal_stem,
    names_of as names_of,
    remark_text as remark_text,
    unique as unique,
)
from ._numbers import (
    figure as figure,
    noted as noted,
    number_text as number_text,
    outward_text as outward_text,
    stored as stored,
)
from ._own_names import (
    with_own_names as with_own_names,
)
from ._tree import (
    LONGEST_NAME as LONGEST_NAME,
    Assign as Assign,
    Block as Block,
    Call as Call,
    Count as Count,
    Element as Element,
    Expression as Expression,
    If as If,
    Instance as Instance,
    Kind as Kind,
    Minus as Minus,
    Name as Name,
    Not as Not,
    Operation as Operation,
    OutputOf as OutputOf,
    Program as Program,
    Remark as Remark,
    Statement as Statement,
    Truth as Truth,
    Two as Two,
    Variable as Variable,
)
from ._walk import (
    ProgramError as ProgramError,
    names_read as names_read,
    reachable as reachable,
    walk as walk,
)
