from ._access import (
    Visitor as Visitor,
    answer_json as answer_json,
    json_of as json_of,
    needs as needs,
    parts_of as parts_of,
    refuse as refuse,
    spoken as spoken,
    visitor_of as visitor_of,
)
from ._answers import (
    LOST as LOST,
    NO_ANSWER as NO_ANSWER,
    Outcome as Outcome,
)
from ._failed_log_ins import (
    FAILURES_BY_ADDRESS as FAILURES_BY_ADDRESS,
)
from ._guard import (
    Guard as Guard,
)
from ._parts import (
    ScreenParts as ScreenParts,
    asset_folder as asset_folder,
    for_script as for_script,
)
from ._persons import (
    LOOP_GONE as LOOP_GONE,
    OUT as OUT,
    Person as Person,
    Persons as Persons,
)
from ._plain_page import (
    kind_of_mistake as kind_of_mistake,
    place_of_mistake as place_of_mistake,
    plain_page as plain_page,
    reference_of as reference_of,
    wants_page as wants_page,
)
