from ._budget import (
    read_budget as read_budget,
)
from ._field_regions import (
    read_regions as read_regions,
)
from ._header import (
    HEADER_FIELDS as HEADER_FIELDS,
    HEADER_GROUPS as HEADER_GROUPS,
    LONGEST_COMMENT as LONGEST_COMMENT,
    LONGEST_TEXT as LONGEST_TEXT,
    NORMALISED as NORMALISED,
    HeaderField as HeaderField,
    number_of as number_of,
    read_header as read_header,
)
from ._limits import (
    FigureCheck as FigureCheck,
    LimitsCheck as LimitsCheck,
    Verdict as Verdict,
    check_limits as check_limits,
    read_limits as read_limits,
)
from ._moments import (
    ZONE_NOT_STATED as ZONE_NOT_STATED,
    day_of as day_of,
    duration_words as duration_words,
    in_file as in_file,
    moment_of as moment_of,
    moment_words as moment_words,
    prevailing_moment as prevailing_moment,
    same_moment as same_moment,
)
