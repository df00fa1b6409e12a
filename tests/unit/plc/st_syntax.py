"""Structured Text to a syntax tree; what no dialect of ours may contain is refused at once."""

import re

import tree_sitter
import tree_sitter_iec61131_3_st
from tree_sitter import Node

LONGEST_FILE = 2_000_000
"""Longest text that is read. [characters]"""

_FOREIGN = re.compile(r"[^ -~\t\n]")
_LANGUAGE = tree_sitter.Language(tree_sitter_iec61131_3_st.language())
_REMARKS = tree_sitter.Query(_LANGUAGE, "(comment) @remark")


class StError(Exception):
    """The text is no program of the subset.

    Parameters
    ----------
    what : str
        What is wrong.
    line : int
        Line, from 1. [1]
    column : int
        Column, from 1. [1]
    """

    def __init__(self, what: str, line: int, column: int = 1) -> None:
        self.what = what
        self.line = line
        self.column = column
        super().__init__(f"line {line}, column {column}: {what}")


def error_at(node: Node, what: str) -> StError:
    """Return the error for a node of the syntax tree."""
    return StError(what, node.start_point.row + 1, node.start_point.column + 1)


def text_of(node: Node) -> str:
    """Return the text of a node."""
    return (node.text or b"").decode()


def inner(node: Node) -> list[tuple[str, Node]]:
    """Return the children that mean something, each with its field: no comments."""
    children = node.children
    return [
        (node.field_name_for_child(k) or "", child)
        for k, child in enumerate(children)
        if child.type != "comment"
    ]


def syntax_tree(text: str) -> Node:
    """Parse a text.

    Parameters
    ----------
    text : str
        Structured Text.

    Returns
    -------
    Node
        The root.

    Raises
    ------
    StError
        If it is too long, has a sign outside of ASCII, a comment of another form than ``(* *)``,
        one within another, or is not what the grammar knows.
    """
    if len(text) > LONGEST_FILE:
        raise StError("the text is too long", 1)
    foreign = _FOREIGN.search(text)
    if foreign is not None:
        before = text[: foreign.start()]
        number, column = before.count("\n") + 1, foreign.start() - before.rfind("\n")
        raise StError(f"the sign {foreign.group()!r} is not in every code page", number, column)
    root = tree_sitter.Parser(_LANGUAGE).parse(text.encode("ascii")).root_node
    _refuse_errors(root)
    return root


def _refuse_errors(root: Node) -> None:
    """Raise at the first place that the grammar does not know."""
    if not root.has_error:
        remarks = tree_sitter.QueryCursor(_REMARKS).captures(root).get("remark", [])
        for remark in remarks:
            _check_comment(remark)
        return
    waiting = [root]
    while waiting:
        node = waiting.pop()
        if node.is_missing:
            raise error_at(node, f"{node.type} is missing")
        if node.is_error:
            raise error_at(node, f"not understood: {text_of(node)[:40]!r}")
        if node.type == "comment":
            _check_comment(node)
        waiting.extend(reversed(node.children))


def _check_comment(node: Node) -> None:
    text = text_of(node)
    if not text.startswith("(*"):
        raise error_at(node, "a comment of another form than (* *)")
    if re.search(r"\(\*", text[2:]):
        raise error_at(node, "a comment in a comment")
