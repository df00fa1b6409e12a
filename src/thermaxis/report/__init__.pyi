from ._figure_table import (
    BudgetTable as BudgetTable,
    FigureRow as FigureRow,
    FigureTable as FigureTable,
    budget_table as budget_table,
    figure_table as figure_table,
)
from ._limits_check import (
    LimitsCheck as LimitsCheck,
    Verdict as Verdict,
    check_limits as check_limits,
)
from ._names import (
    FIGURE_NAMES as FIGURE_NAMES,
    FIGURE_SYMBOLS as FIGURE_SYMBOLS,
    OTHER_NAMES as OTHER_NAMES,
    absence_reason as absence_reason,
    edition_name as edition_name,
    other_standard_name as other_standard_name,
)
from ._output import write_bytes as write_bytes
from ._positioning_report import PositioningReport as PositioningReport
from ._progress import Progress as Progress
from ._text import fixed as fixed
from ._thermal_test_report import (
    CompensationCase as CompensationCase,
    ThermalTestReport as ThermalTestReport,
)
from .certificate import (
    unshowable as unshowable,
    write_report as write_report,
)
from .charts import (
    draw_figure as draw_figure,
    write_field_figures as write_field_figures,
    write_figures as write_figures,
    write_montecarlo_figures as write_montecarlo_figures,
)
from .thermal import (
    ComparedModel as ComparedModel,
    write_comparison_figures as write_comparison_figures,
    write_comparison_report as write_comparison_report,
    write_identification_figures as write_identification_figures,
    write_identification_report as write_identification_report,
    write_thermal_test_figures as write_thermal_test_figures,
    write_thermal_test_report as write_thermal_test_report,
    write_verification_figures as write_verification_figures,
    write_verification_report as write_verification_report,
)
from .trend import (
    Trend as Trend,
    TrendChange as TrendChange,
    TrendFigure as TrendFigure,
    TrendRun as TrendRun,
    evaluate_trend as evaluate_trend,
    trend_table as trend_table,
    write_trend_figures as write_trend_figures,
)
