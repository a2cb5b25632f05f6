"""Statements of a generated function as instructions, without asking for a type of each of them.

An arm's equations are thousands of products and sums of doubles, one after the other. Numba infers
the type of every one, which took nine tenths of the time to compile them; here all numbers are of
one kind, double or wide (core.lanes), and each statement is written as the instruction that it is.
"""

from __future__ import annotations

import ast
import inspect
import operator
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from llvmlite import ir

from ..compiler import intrinsic, types
from ..lanes.wide import LANES, VECTOR, wide

DOUBLE = ir.DoubleType()
ARITHMETIC: dict[type[ast.operator], tuple[str, Callable[[float, float], float]]] = {
    ast.Add: ("fadd", operator.add),
    ast.Sub: ("fsub", operator.sub),
    ast.Mult: ("fmul", operator.mul),
    ast.Div: ("fdiv", operator.truediv),
}
"""Operator -> LLVM's instruction, and what it is of two numbers that are known."""


def straight_line(columns: int, lanes: bool = False, fast: Sequence[str] = ()) -> Any:
    """Decorate a function of arrays that only assigns, so that compiled code can call it.

    Args:
        columns: of its matrices.
        lanes: its numbers are wide, in arrays (entries, LANES); else doubles, in arrays (entries,).
        fast: what the compiler may change of the arithmetic, as LLVM calls it.

    Raises:
        NotImplementedError: from the compiler, of anything but arithmetic and calls by name.
    """

    def decorated(function: Callable[..., None]) -> Any:
        def typing(typingctx, *arrays):  # type: ignore[no-untyped-def]
            def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
                text = _functions(function.__code__.co_filename)[function.__name__]
                places = [
                    context.make_array(kind)(context, builder, array).data
                    for kind, array in zip(sig.args, args, strict=True)
                ]
                names = dict(zip((a.arg for a in text.args.args), places, strict=True))
                module_names = function.__globals__
                write = _Writer(context, builder, names, columns, lanes, tuple(fast), module_names)
                for statement in text.body:
                    write.statement(statement)
                return context.get_dummy_value()

            return types.void(*arrays), emit

        # By name, since Numba would gather arguments without names in a tuple.
        names = ["typingctx", *inspect.signature(function).parameters]
        kinds = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_ONLY) for name in names]
        typing.__signature__ = inspect.Signature(kinds)  # type: ignore[attr-defined]
        return intrinsic(typing)

    return decorated


@cache
def _functions(file: str) -> dict[str, ast.FunctionDef]:
    """name -> syntax of a module's functions."""
    body = ast.parse(Path(file).read_text(encoding="utf-8")).body
    return {node.name: node for node in body if isinstance(node, ast.FunctionDef)}


class _Writer:
    """Writes statements at the end of a block of instructions."""

    def __init__(
        self, context: Any, builder: Any, names: dict[str, Any], columns: int, lanes: bool,
        fast: tuple[str, ...], functions: dict[str, Any],
    ) -> None:  # fmt: skip
        self.context, self.builder, self.names = context, builder, names
        self.columns, self.fast, self.functions = columns, fast, functions
        self.lanes = LANES if lanes else 1
        self.kind: Any = wide if lanes else types.float64

    def statement(self, node: ast.stmt) -> None:
        """Write one assignment."""
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self.names[name] = self.value(value)
            case ast.Assign(targets=[ast.Subscript() as entry], value=value):
                self.builder.store(self.value(value), self.place(entry), align=8)
            case ast.AugAssign(target=ast.Subscript() as entry, op=ast.Add(), value=value):
                total = self.builder.fadd(self.entry(entry), self.value(value), flags=self.fast)
                self.builder.store(total, self.place(entry), align=8)
            case _:
                raise NotImplementedError(ast.unparse(node))

    def value(self, node: ast.expr) -> Any:
        """What an expression is; a number without a name is folded as Python does."""
        folded = _folded(node)
        if folded is not None:
            return self.constant(folded)
        match node:
            case ast.Name(id=name):
                return self.names[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self.builder.fneg(self.value(operand))
            case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int(power))) if (
                power > 1
            ):
                return self.power(self.value(left), power)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
                instruction = getattr(self.builder, ARITHMETIC[type(op)][0])
                return instruction(self.value(left), self.value(right), flags=self.fast)
            case ast.Subscript():
                return self.entry(node)
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self.call(name, [self.value(a) for a in arguments])
        raise NotImplementedError(ast.unparse(node))

    def constant(self, number: float) -> Any:
        if self.lanes == 1:
            return ir.Constant(DOUBLE, number)
        return ir.Constant(VECTOR, [number] * self.lanes)

    def power(self, base: Any, power: int) -> Any:
        """By squaring; a whole power of two or more."""
        half = base if power // 2 == 1 else self.power(base, power // 2)
        square = self.builder.fmul(half, half, flags=self.fast)
        return self.builder.fmul(square, base, flags=self.fast) if power % 2 else square

    def place(self, entry: ast.Subscript) -> Any:
        """The address of an entry of an array."""
        assert isinstance(entry.value, ast.Name)
        index = ast.literal_eval(entry.slice)
        at = index[0] * self.columns + index[1] if isinstance(index, tuple) else index
        first = ir.Constant(ir.IntType(64), at * self.lanes)
        place = self.builder.gep(self.names[entry.value.id], [first])
        return place if self.lanes == 1 else self.builder.bitcast(place, VECTOR.as_pointer())

    def entry(self, entry: ast.Subscript) -> Any:
        return self.builder.load(self.place(entry), align=8)

    def call(self, name: str, arguments: list[Any]) -> Any:
        """Of a function that the module knows, compiled for this kind of number."""
        typing, kinds = self.context.typing_context, (self.kind,) * len(arguments)
        function = typing.resolve_value_type(self.functions[name])
        signature = function.get_call_type(typing, kinds, {})
        compiled = self.context.get_function(function, signature)
        self.context.add_linking_libs(getattr(compiled, "libs", ()))
        return compiled(self.builder, arguments)


def _folded(node: ast.expr) -> float | None:
    """The number that an expression of numbers is."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            inner = _folded(operand)
            return None if inner is None else -inner
        case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
            a, b = _folded(left), _folded(right)
            return None if a is None or b is None else ARITHMETIC[type(op)][1](a, b)
    return None
