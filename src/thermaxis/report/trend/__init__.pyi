from ._chart import write_trend_figures as write_trend_figures
from ._trend import (
    Trend as Trend,
    TrendChange as TrendChange,
    TrendFigure as TrendFigure,
    TrendRun as TrendRun,
    evaluate_trend as evaluate_trend,
    trend_table as trend_table,
)
