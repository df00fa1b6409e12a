from ._drift_model import (
    growth_unit as growth_unit,
    reference_place as reference_place,
    time_words as time_words,
)
from ._field import write_field_figures as write_field_figures
from ._figures import (
    charts_of as charts_of,
    draw_figure as draw_figure,
    write_figures as write_figures,
    write_montecarlo_figures as write_montecarlo_figures,
)
from ._parts import (
    at_position as at_position,
    detail_decimals as detail_decimals,
    pair_labels as pair_labels,
    runs_of_targets as runs_of_targets,
)
