"""Formulas of a user's own, as text: small programs for a stack of numbers.

The text is as in OpenSim: + - * / ^, functions, and after a semicolon what names in it stand for,
`k * stretch; k = 100; stretch = d - 0.1`.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...errors import ParameterError
from ...numerics.kernel import kernel

NUMBER, VARIABLE, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, NEGATE = range(8)
OPERATORS: dict[type, int] = {
    ast.Add: ADD, ast.Sub: SUBTRACT, ast.Mult: MULTIPLY, ast.Div: DIVIDE, ast.Pow: POWER
}  # fmt: skip
# Of one argument from 8 on, of two from 40 on, of three from 50 on.
FUNCTIONS = {
    "sqrt": 8, "exp": 9, "log": 10, "sin": 11, "cos": 12, "tan": 13, "sec": 14, "csc": 15,
    "cot": 16, "asin": 17, "acos": 18, "atan": 19, "sinh": 20, "cosh": 21, "tanh": 22, "erf": 23,
    "erfc": 24, "step": 25, "delta": 26, "square": 27, "cube": 28, "recip": 29, "abs": 30,
    "floor": 31, "ceil": 32, "min": 40, "max": 41, "atan2": 42, "select": 50,
}  # fmt: skip
OF_TWO, OF_THREE = 40, 50
LARGEST = 1e300  # number in a text
LONGEST = 10_000  # characters of a text from a stranger
STACK = 64  # numbers that wait for another one
MOST = 10_000  # steps of a program: names that stand for names multiply


class Program(NamedTuple):
    """Steps one after the other: `codes` (k,) and, of numbers and variables, `values` (k,)."""

    codes: tuple[int, ...]
    values: tuple[float, ...]


class Programs(NamedTuple):
    """Programs one behind the other; number i has the steps starts[i] to starts[i + 1]."""

    codes: np.ndarray
    values: np.ndarray
    starts: np.ndarray


def program(text: str, variables: Sequence[str]) -> Program:
    """What evaluates a formula of these variables.

    Raises
    ------
    ParameterError
        The text is no formula, or has names that nothing stands for; quotes it.

    Examples
    --------
    >>> program("2 * q^2; q = x", ["x"]).codes
    (0, 1, 0, 6, 4)
    """
    if len(text) > LONGEST:
        raise ParameterError(f"a formula of {len(text)} characters; at most {LONGEST} are read")
    whole, *named = text.split(";")
    numbers = {name: number for number, name in enumerate(variables)}
    if "#" in text:
        raise ParameterError(f"'{text}' is not a formula")
    meaning: dict[str, ast.expr] = {}
    for each in named:
        if not each.strip():
            continue
        name, _, right = each.partition("=")
        meaning.setdefault(name.strip(), _parsed(right, text))  # the first one counts, as there
    codes: list[int] = []
    values: list[float] = []
    _Writer(text, numbers, meaning, codes, values).write(_parsed(whole, text), ())
    depth = deepest = 0
    for code in codes:
        depth += 1 - _arguments(code)
        deepest = max(deepest, depth)
    if deepest > STACK:
        raise ParameterError(f"the formula '{text}' is nested too deeply")
    return Program(tuple(codes), tuple(values))


def pack_programs(programs: Sequence[Program]) -> Programs:
    """The programs as the kernels take them."""
    codes = np.array([code for each in programs for code in each.codes], dtype=np.int64)
    values = np.array([value for each in programs for value in each.values], dtype=float)
    starts = np.cumsum([0, *(len(each.codes) for each in programs)])
    return Programs(codes, values, starts.astype(np.int64))


def _parsed(text: str, whole: str) -> ast.expr:
    try:
        return ast.parse(" ".join(text.split()).replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ParameterError(f"'{whole}' is not a formula") from None


def _arguments(code: int) -> int:
    """How many numbers a step takes."""
    if code in (NUMBER, VARIABLE):
        return 0
    if code >= OF_THREE:
        return 3
    return 2 if code >= OF_TWO or ADD <= code <= POWER else 1


class _Writer:
    """Writes the steps of one formula."""

    def __init__(
        self,
        text: str,
        numbers: Mapping[str, int],
        meaning: Mapping[str, ast.expr],
        codes: list[int],
        values: list[float],
    ) -> None:
        self._text, self._numbers, self._meaning = text, numbers, meaning
        self._codes, self._values = codes, values

    def _error(self, why: str) -> ParameterError:
        return ParameterError(f"the formula '{self._text}' {why}")

    def _step(self, code: int, value: float = 0.0) -> None:
        if len(self._codes) == MOST:
            raise self._error("is too long")
        self._codes.append(code)
        self._values.append(value)

    def write(self, node: ast.expr, within: tuple[str, ...]) -> None:
        """Write a part; `within` are the names that it stands for."""
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                if not abs(value) <= LARGEST:
                    raise self._error("has a number that is too large")
                self._step(NUMBER, float(value))
            case ast.Name(id=name) if name in self._meaning and name not in within:
                self.write(self._meaning[name], (*within, name))
            case ast.Name(id=name) if name in self._numbers:
                self._step(VARIABLE, self._numbers[name])
            case ast.Name(id=name):
                known = ", ".join(self._numbers)
                raise self._error(f"has the name '{name}', which stands for nothing: {known} do")
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                self.write(inner, within)
                self._step(NEGATE)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                self.write(inner, within)
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in OPERATORS:
                self.write(left, within)
                self.write(right, within)
                self._step(OPERATORS[type(operator)])
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if (
                name in FUNCTIONS and len(arguments) == _arguments(FUNCTIONS[name])
            ):
                for argument in arguments:
                    self.write(argument, within)
                self._step(FUNCTIONS[name])
            case _:
                raise self._error(f"has '{ast.unparse(node)}', which is none of its operations")


@kernel
def of_one(code, x):
    """A function of one number."""
    if code == NEGATE:
        return -x
    if code == 8:
        return math.sqrt(x)
    if code == 9:
        return math.exp(x)
    if code == 10:
        return math.log(x)
    if code == 11:
        return math.sin(x)
    if code == 12:
        return math.cos(x)
    if code == 13:
        return math.tan(x)
    if code == 14:
        return 1.0 / math.cos(x)
    if code == 15:
        return 1.0 / math.sin(x)
    if code == 16:
        return 1.0 / math.tan(x)
    if code == 17:
        return math.asin(x)
    if code == 18:
        return math.acos(x)
    if code == 19:
        return math.atan(x)
    if code == 20:
        return math.sinh(x)
    if code == 21:
        return math.cosh(x)
    if code == 22:
        return math.tanh(x)
    if code == 23:
        return math.erf(x)
    if code == 24:
        return math.erfc(x)
    if code == 25:
        return 1.0 if x >= 0.0 else 0.0
    if code == 26:
        return 1.0 if x == 0.0 else 0.0
    if code == 27:
        return x * x
    if code == 28:
        return x * x * x
    if code == 29:
        return 1.0 / x
    if code == 30:
        return abs(x)
    if code == 31:
        return float(math.floor(x))
    return float(math.ceil(x))


@kernel
def of_two(code, x, y):
    """An operation on two numbers."""
    if code == ADD:
        return x + y
    if code == SUBTRACT:
        return x - y
    if code == MULTIPLY:
        return x * y
    if code == DIVIDE:
        return x / y
    if code == POWER:
        return x**y
    if code == 40:
        return min(x, y)
    if code == 41:
        return max(x, y)
    return math.atan2(x, y)


@kernel
def run(programs, number, variables, stack):
    """The value of a program, with `stack` (STACK,) for the work."""
    top = -1
    for k in range(programs.starts[number], programs.starts[number + 1]):
        code, value = programs.codes[k], programs.values[k]
        if code == NUMBER:
            top += 1
            stack[top] = value
        elif code == VARIABLE:
            top += 1
            stack[top] = variables[int(value)]
        elif code >= OF_THREE:
            top -= 2
            stack[top] = stack[top + 1] if stack[top] != 0.0 else stack[top + 2]
        elif code >= OF_TWO or (code >= ADD and code <= POWER):
            top -= 1
            stack[top] = of_two(code, stack[top], stack[top + 1])
        else:
            stack[top] = of_one(code, stack[top])
    return stack[0]
