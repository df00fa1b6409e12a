from ._compared_model import (
    ComparedModel as ComparedModel,
)
from ._lines import (
    drawn_line as drawn_line,
)
from ._output import (
    write_comparison_figures as write_comparison_figures,
    write_comparison_report as write_comparison_report,
    write_identification_figures as write_identification_figures,
    write_identification_report as write_identification_report,
    write_verification_figures as write_verification_figures,
    write_verification_report as write_verification_report,
)
from ._thermal_test import (
    write_thermal_test_figures as write_thermal_test_figures,
    write_thermal_test_report as write_thermal_test_report,
)
