from ._columns import (
    CHANNEL_PREFIX as CHANNEL_PREFIX,
    Heading as Heading,
    Role as Role,
    Unit as Unit,
    deviation_unit as deviation_unit,
    direction_named as direction_named,
    is_date_name as is_date_name,
    is_summary as is_summary,
    parse_heading as parse_heading,
    unit_named as unit_named,
)
from ._csv_rows import (
    best_split as best_split,
    csv_table as csv_table,
    is_comment_line as is_comment_line,
    is_separator_line as is_separator_line,
    split_cells as split_cells,
)
from ._mapping import NO_MAPPING as NO_MAPPING, RunColumn as RunColumn, RunMapping as RunMapping
from ._metadata import metadata_lines as metadata_lines
from ._numbers import (
    MISSING_WORDS as MISSING_WORDS,
    TOLD_MISSING as TOLD_MISSING,
    numeric_cells as numeric_cells,
)
from ._quantities import (
    TARGET_RESOLUTION as TARGET_RESOLUTION,
    check_start_and_end as check_start_and_end,
    group_targets as group_targets,
    one_target_each as one_target_each,
    target_column_of as target_column_of,
    unit_elsewhere as unit_elsewhere,
    unit_of_kind as unit_of_kind,
)
from ._source import (
    FALLBACK_ENCODING as FALLBACK_ENCODING,
    NUMBER_LIMIT as NUMBER_LIMIT,
    SourceText as SourceText,
    check_is_text as check_is_text,
    clean_text as clean_text,
    decode_text as decode_text,
    decoded as decoded,
    encoded as encoded,
    first_few as first_few,
    is_number as is_number,
    kind_of_content as kind_of_content,
    parse_number as parse_number,
    parse_whole_number as parse_whole_number,
    protected as protected,
    quoted as quoted,
    read_content as read_content,
    read_start as read_start,
    read_text as read_text,
    unprotected as unprotected,
)
from ._table import (
    Layout as Layout,
    Row as Row,
    Table as Table,
    TableSource as TableSource,
    listed as listed,
    unique_names as unique_names,
)
from ._times import (
    ReadingTimes as ReadingTimes,
    parse_moment as parse_moment,
    read_stamps as read_stamps,
    reading_times as reading_times,
    seconds_since as seconds_since,
    spread_in_intervals as spread_in_intervals,
    stamp_moments as stamp_moments,
)
from ._workbook import (
    Cells as Cells,
    cell_text as cell_text,
    opened_sheets as opened_sheets,
    workbook_table as workbook_table,
)
from ._workbook_parts import DAMAGE as DAMAGE, damage_named as damage_named
