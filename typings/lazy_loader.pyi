from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeAlias

_Attached: TypeAlias = tuple[Callable[[str], object], Callable[[], list[str]], list[str]]

def attach(
    package_name: str,
    submodules: Iterable[str] | None = None,
    submod_attrs: Mapping[str, Sequence[str]] | None = None,
) -> _Attached: ...
def attach_stub(package_name: str, filename: str) -> _Attached: ...
