"""Small faults put into a module, one at a time: what a programmer mistypes, a sign, a bound, a condition, a number."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.LtE), ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.In: (ast.NotIn,), ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,),
}
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}
OPPOSITES = {
    "min": "max", "minimum": "maximum", "argmin": "argmax", "any": "all", "floor": "ceil", "zeros": "ones",
}
OPPOSITES |= {other: one for one, other in OPPOSITES.items()}


class Mutant(NamedTuple):
    """A fault: the line it is in, what it does, and the module's text with it."""

    line: int
    what: str
    text: str


class _Edit(NamedTuple):
    """What puts a fault in, and what takes it out again."""

    do: Callable[[], object]
    undo: Callable[[], object]


def mutants_of(text: str) -> Iterator[Mutant]:
    """All mutants of a module. Names, types, docstrings and the words of errors are left as they are."""
    tree = ast.parse(text)
    for node in list(_nodes(tree)):
        for edit in _edits(node):
            before = ast.unparse(node)
            edit.do()
            yield Mutant(node.lineno, f"{_short(before)}  ->  {_short(ast.unparse(node))}", ast.unparse(tree))
            edit.undo()
        for body, k in _droppable(node):
            line, body[k] = body[k], ast.Pass()
            yield Mutant(line.lineno, f"{_short(ast.unparse(line))}  ->  pass", ast.unparse(tree))
            body[k] = line


def _short(code: str) -> str:
    return " ".join(code.split())[:120]


def _nodes(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    """Where faults may be; those within an error's words, a type or a docstring would say nothing about the tests."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
        return
    if isinstance(node, ast.expr | ast.stmt):
        yield node
    for name, value in ast.iter_fields(node):
        if name not in ("annotation", "returns", "decorator_list"):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and not (isinstance(node, ast.Raise) and isinstance(child, ast.Call)):
                    yield from _nodes(child)


def _edits(node: ast.expr | ast.stmt) -> Iterator[_Edit]:
    match node:
        case ast.Compare():
            for k, op in enumerate(node.ops):
                for other in COMPARISONS[type(op)]:
                    yield _Edit(partial(node.ops.__setitem__, k, other()), partial(node.ops.__setitem__, k, op))
        case ast.BinOp() | ast.AugAssign() if type(node.op) in ARITHMETIC:
            yield _set(node, "op", ARITHMETIC[type(node.op)]())
        case ast.UnaryOp(op=ast.USub()):
            yield _set(node, "op", ast.UAdd())
        case ast.UnaryOp(op=ast.Not() | ast.Invert()):
            yield _set(node, "operand", ast.UnaryOp(node.op, node.operand))
        case ast.BoolOp():
            yield _set(node, "op", ast.Or() if isinstance(node.op, ast.And) else ast.And())
        case ast.Constant(value=bool()):
            yield _set(node, "value", not node.value)
        case ast.Constant(value=int()):
            yield _set(node, "value", node.value + 1)
        case ast.Constant(value=float()):
            yield _set(node, "value", 2 * node.value or 1.0)
        case ast.If() | ast.IfExp() | ast.While():
            yield _set(node, "test", ast.UnaryOp(ast.Not(), node.test))
        case ast.Attribute(attr=name) if name in OPPOSITES:
            yield _set(node, "attr", OPPOSITES[name])
        case ast.Name(id=name) if name in OPPOSITES:
            yield _set(node, "id", OPPOSITES[name])


def _set(node: ast.AST, name: str, value: object) -> _Edit:
    return _Edit(partial(setattr, node, name, value), partial(setattr, node, name, getattr(node, name)))


def _droppable(node: ast.AST) -> Iterator[tuple[list[ast.stmt], int]]:
    """The statements of a block that may be left out, and the rest still makes sense."""
    for body in (getattr(node, "body", None), getattr(node, "orelse", None)):
        for k, line in enumerate(body if isinstance(body, list) else ()):
            is_call = isinstance(line, ast.Expr) and isinstance(line.value, ast.Call)
            if is_call or isinstance(line, ast.AugAssign | ast.Raise | ast.Break | ast.Continue):
                yield body, k
