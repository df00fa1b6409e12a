from ._chart import write_trend_figures as write_trend_figures
from ._trend import (
    RunFigures as RunFigures,
    Trend as Trend,
    TrendChange as TrendChange,
    TrendFigure as TrendFigure,
    TrendRun as TrendRun,
    air_differs as air_differs,
    change_of as change_of,
    evaluate_trend as evaluate_trend,
    mean_air_c as mean_air_c,
    shown_figures as shown_figures,
    trend_table as trend_table,
)
