from ._guide import (
    GuideFacts as GuideFacts,
    guide_text as guide_text,
)
from ._report import (
    LARGEST_S7_300_BYTES as LARGEST_S7_300_BYTES,
    REPORT_ENDING as REPORT_ENDING,
    REPORT_FORMAT as REPORT_FORMAT,
    REPORT_HASH as REPORT_HASH,
    TEMPCOMP as TEMPCOMP,
    ReportFacts as ReportFacts,
    Target as Target,
    instance_bytes as instance_bytes,
    report_of as report_of,
    report_sha256 as report_sha256,
    report_text as report_text,
)
