from ._innovations import (
    Comparison as Comparison,
    Innovations as Innovations,
    compared as compared,
    innovations_of as innovations_of,
)
from ._relearn import (
    Candidate as Candidate,
    Proposal as Proposal,
    RelearnedOutput as RelearnedOutput,
    RelearnOptions as RelearnOptions,
    relearn as relearn,
)
