from ._described import (
    Part as Part,
    Section as Section,
    Table as Table,
    Value as Value,
    as_json as as_json,
    as_page_table as as_page_table,
    as_text as as_text,
    messages_of as messages_of,
    rows_of as rows_of,
    values_of as values_of,
    without_text as without_text,
)
from ._evaluation import (
    describe_evaluation as describe_evaluation,
    options_in_words as options_in_words,
)
from ._results import results_json as results_json, results_sha256 as results_sha256
from ._summary import summary_of as summary_of
from ._text_table import filled as filled, text_table as text_table
from ._thermal_test import (
    CASES as CASES,
    QUANTITY_UNITS as QUANTITY_UNITS,
    TITLES as TITLES,
    compared_table as compared_table,
    describe_thermal_test as describe_thermal_test,
    lines_of as lines_of,
    tables_of as tables_of,
)
