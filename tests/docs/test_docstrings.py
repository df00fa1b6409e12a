"""Public functions and classes carry numpydoc docstrings; units and sources included."""

import ast
import importlib
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator

import pytest

PORTS = (
    *("thermaxis.runtime", "thermaxis.runtime.sources", "thermaxis.runtime.sinks"),
    *("thermaxis.runtime.historian", "thermaxis.virtual"),
)
"""Packages of ports: every source has the same `read`. A method needs its sentence there, with the
unit; what it takes and promises stands once, with the port."""
PACKAGES = (
    *("thermaxis.positioning", "thermaxis.files", "thermaxis.thermal", "thermaxis.report"),
    *("thermaxis.controls", "thermaxis.compensation", *PORTS),
)
SECTION = re.compile(r"^([A-Z][A-Za-z]+)\n-{3,}$", re.MULTILINE)


def public_objects() -> Iterator[tuple[str, object]]:
    for package in PACKAGES:
        module = importlib.import_module(package)
        for name in module.__all__:
            value = getattr(module, name)
            if inspect.isfunction(value) or inspect.isclass(value):
                yield f"{package}.{name}", value


def public_functions() -> Iterator[tuple[str, Callable[..., object]]]:
    for name, value in public_objects():
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value):
            for method_name, method in vars(value).items():
                if inspect.isfunction(method) and not method_name.startswith("_"):
                    yield f"{name}.{method_name}", method


OBJECTS = dict(public_objects())
FUNCTIONS = dict(public_functions())
CLASSES = {name: value for name, value in OBJECTS.items() if inspect.isclass(value)}


def sections(text: str) -> dict[str, str]:
    parts = SECTION.split(inspect.cleandoc(text))
    return dict(zip(["Summary", *parts[1::2]], parts[0::2], strict=True))


def parameters(function: Callable[..., object]) -> list[str]:
    return [name for name in inspect.signature(function).parameters if name != "self"]


def is_method_of_a_port(name: str) -> bool:
    return any(re.fullmatch(rf"{re.escape(package)}\.[A-Z]\w*\.\w+", name) for package in PORTS)


def missing_in_docstring(
    function: Callable[..., object], *, summary_alone: bool = False
) -> list[str]:
    parts = sections(function.__doc__ or "")
    missing = [] if parts["Summary"].strip() else ["summary"]
    if summary_alone and len(parts) == 1:
        return missing
    documented = set()
    for line in re.findall(r"^(\S[^\n:]*?)(?: ?:|$)", parts.get("Parameters", ""), re.MULTILINE):
        documented |= {word.strip().lstrip("*") for word in line.split(",")}
    missing += [name for name in parameters(function) if name not in documented]
    returns = inspect.signature(function).return_annotation
    if returns not in (None, "None", inspect.Signature.empty) and not {"Returns", "Yields"} & set(
        parts
    ):
        missing.append("Returns")
    return missing


def undocumented_fields(definition: ast.ClassDef) -> list[str]:
    fields = [
        (statement, following)
        for statement, following in zip(
            definition.body, [*definition.body[1:], ast.Pass()], strict=True
        )
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name)
    ]
    return [
        statement.target.id
        for statement, following in fields
        if isinstance(statement.target, ast.Name)
        and not statement.target.id.startswith("_")
        and not (
            isinstance(following, ast.Expr)
            and isinstance(following.value, ast.Constant)
            and isinstance(following.value.value, str)
        )
    ]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_function_documents_its_parameters_and_what_it_returns(name: str) -> None:
    found = missing_in_docstring(FUNCTIONS[name], summary_alone=is_method_of_a_port(name))
    assert found == []


@pytest.mark.parametrize("name", CLASSES)
def test_a_public_class_documents_itself_and_every_field(name: str) -> None:
    assert (CLASSES[name].__doc__ or "").strip()
    source = textwrap.dedent(inspect.getsource(CLASSES[name]))
    definition = ast.parse(source).body[0]
    assert isinstance(definition, ast.ClassDef)
    assert undocumented_fields(definition) == []


SOURCE = re.compile(r"ISO|GOST|VDI|JCGM|Stejskal|[A-Z]\w+ (?:19|20)\d\d")
WITHOUT_SOURCE = {
    "thermaxis.positioning.evaluate_duration": "way over feed, and times added up",
}
"""Functions that need none, and why."""


def sources_of(name: str) -> str:
    """Return the references of a function, or of the one that they point to."""
    references = sections(FUNCTIONS[name].__doc__ or "").get("References", "")
    pointed = re.search(r"As in `(\w+)`", references)
    return sources_of(f"{name.rpartition('.')[0]}.{pointed[1]}") if pointed else references


@pytest.mark.parametrize(
    "name", [n for n in FUNCTIONS if ".positioning.evaluate_" in n and n not in WITHOUT_SOURCE]
)
def test_an_evaluating_function_names_its_source(name: str) -> None:
    assert SOURCE.search(sources_of(name))


def test_no_function_is_excused_that_does_not_exist() -> None:
    assert set(WITHOUT_SOURCE) <= set(FUNCTIONS)


def test_an_incomplete_docstring_is_noticed() -> None:
    def halve(length_mm: float, *, twice: bool = False) -> float:
        """Halve a length.

        Parameters
        ----------
        length_mm : float
            The length. [mm]
        """
        return length_mm / (4.0 if twice else 2.0)

    assert missing_in_docstring(halve) == ["twice", "Returns"]
    assert missing_in_docstring(halve, summary_alone=True) == ["twice", "Returns"]
    assert missing_in_docstring(lambda x: x, summary_alone=True) == ["summary"]
    assert is_method_of_a_port("thermaxis.runtime.Source.read")
    assert not is_method_of_a_port("thermaxis.runtime.read_machine")
    definition = ast.parse('class A:\n    a: int\n    b: int\n    """Said."""\n').body[0]
    assert isinstance(definition, ast.ClassDef)
    assert undocumented_fields(definition) == ["a"]
