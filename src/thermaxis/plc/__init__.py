"""The compensation as text for a PLC: one tree, printed as ST, SCL and C.

What the block does is `thermaxis.compensation.cycle`, in the number type of the target. It is
built once (`build_program`), as a tree of few kinds of statement (`_tree`), and every dialect
prints the same tree. `Twin` is the block once more, in plain Python with the target's rounding,
not made from the tree: it computes the test vectors.
"""

from thermaxis.plc._build import build_program
from thermaxis.plc._check import check_program
from thermaxis.plc._course import Course, course_steps
from thermaxis.plc._guide import GuideFacts, guide_text
from thermaxis.plc._names import PlcNames
from thermaxis.plc._own_names import with_own_names
from thermaxis.plc._print_c import CText, print_c
from thermaxis.plc._print_scl import SclCpu, print_scl
from thermaxis.plc._print_st import StFlavour, print_st
from thermaxis.plc._report import Difference, ReportFacts, Target, report_of, report_text
from thermaxis.plc._scenario import scenario, scenario_steps
from thermaxis.plc._settings import PlcSettings, export_settings
from thermaxis.plc._tempcomp import LineSettings, build_line_program
from thermaxis.plc._tree import Block, Program
from thermaxis.plc._twin import PlcInputs, PlcOutputs, Twin
from thermaxis.plc._vectors import Vectors, line_vectors_csv, vectors_csv, vectors_of
from thermaxis.plc._walk import ProgramError
from thermaxis.plc._world import PlcStep

__all__ = [
    "Block",
    "CText",
    "Course",
    "Difference",
    "GuideFacts",
    "LineSettings",
    "PlcInputs",
    "PlcNames",
    "PlcOutputs",
    "PlcSettings",
    "PlcStep",
    "Program",
    "ProgramError",
    "ReportFacts",
    "SclCpu",
    "StFlavour",
    "Target",
    "Twin",
    "Vectors",
    "build_line_program",
    "build_program",
    "check_program",
    "course_steps",
    "export_settings",
    "guide_text",
    "line_vectors_csv",
    "print_c",
    "print_scl",
    "print_st",
    "report_of",
    "report_text",
    "scenario",
    "scenario_steps",
    "vectors_csv",
    "vectors_of",
    "with_own_names",
]
