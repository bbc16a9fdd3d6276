"""Expressions such as ``"=2*r + 5 mm"`` of numbers with units, parameters and a few functions; nothing else is evaluated.

The text is parsed to Python's syntax tree, of which only arithmetic is evaluated; pint handles the units.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import AfterValidator

from kedfem.scene.records.units import crossed, fault, revolutions, unit_of, unit_registry
from kedfem.scene.records.wording import shown, unknown_name

LONGEST_EXPRESSION = 1000  # letters
MOST_POWER = 9.0  # largest exponent, of either sign
NUMBER_HERE = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?", re.ASCII)
WORD_HERE = re.compile(r"[^\W\d]\w*|[°%]")
UNIT_WORD = r"(?:[A-Za-zµμΩ][A-Za-zµμΩ_0-9]{0,30}|°|%)(?:(?:\^|\*\*)-?[1-9](?![0-9.])|⁻?[¹²³⁴⁵⁶⁷⁸⁹])?"
UNIT_HERE = re.compile(rf"\s?({UNIT_WORD})")
MORE_UNIT = re.compile(rf"(\s?[*/·]\s?|\s)({UNIT_WORD})")
ALLOWED = re.compile(r"[-+*/(),^·\s]")
OPERATORS: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip
CONSTANTS = {"pi": math.pi}
ANGLES: dict[str, Callable[[float], float]] = {"sin": math.sin, "cos": math.cos, "tan": math.tan}
NUMBERS: dict[str, Callable[[float], float]] = {
    "asin": math.asin, "acos": math.acos, "atan": math.atan, "exp": math.exp, "log": math.log,
}  # fmt: skip
ALIKE: dict[str, Callable[..., float]] = {"min": min, "max": max, "hypot": math.hypot, "atan2": math.atan2}
FUNCTIONS = (*ANGLES, *NUMBERS, *ALIKE, "sqrt", "abs")
RESERVED = frozenset({*FUNCTIONS, *CONSTANTS})


def evaluated(text: str, known: Mapping[str, Any]) -> Any:
    """Value of an expression, a pint quantity.

    Parameters
    ----------
    text : the expression, without its equals sign
    known : quantities of parameters by name; looking one up may raise ValueError

    Raises
    ------
    ValueError
        The text is no expression or too long, has an unknown name or unit, divides by zero, mixes units or is not finite.
    """
    if len(text) > LONGEST_EXPRESSION:
        raise ValueError(f"it must have at most {LONGEST_EXPRESSION} letters, not {len(text)}")
    source = _Source(text, known)
    try:
        tree = ast.parse(source.python(), mode="eval")
        found = _Walk(source.literals, known).of(tree.body)
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError("it is not an expression of numbers, units, parameters, + - * / ^ and ( )") from None
    except ArithmeticError:
        raise ValueError("its numbers grow beyond all bounds") from None
    except TypeError:  # pint's, e.g. of degrees Celsius
        raise ValueError("it has a unit that cannot be multiplied or added") from None
    return found


def plain_number(quantity: Any) -> float | int | None:
    """Number of a quantity without a unit, an int if it is whole; None if the quantity has a unit."""
    if not quantity.dimensionless or revolutions(quantity._units):
        return None
    number = float(quantity.m_as(""))
    return int(number) if number.is_integer() and abs(number) < 2**53 else number


@dataclass
class _Source:
    """Translator of an expression to Python's syntax, in which numbers with units become names of literals."""

    text: str
    known: Mapping[str, Any]
    literals: dict[str, Any] = field(default_factory=dict)

    def python(self) -> str:
        out, at, text = "", 0, self.text
        while at < len(text):
            if number := NUMBER_HERE.match(text, at):
                at = self._literal(float(number[0]), number.end())
                out += f" _{len(self.literals) - 1} "
            elif (word := WORD_HERE.match(text, at)) and not word[0].startswith("_"):
                out, at = out + word[0], word.end()
            elif sign := ALLOWED.match(text, at):
                out += {"^": "**", "·": "*"}.get(sign[0], " " if sign[0].isspace() else sign[0])
                at = sign.end()
            else:
                raise ValueError(f"it must not hold {text[at]!r}")
        return out.strip()

    def _literal(self, number: float, at: int) -> int:
        """Store a number with the unit that follows it, and return the place where both end."""
        unit, end = "", at
        if (first := UNIT_HERE.match(self.text, at)) and not self.text[first.end() :].startswith("("):
            unit, end = first[1], first.end()
            while (more := MORE_UNIT.match(self.text, end)) and self._goes_on(more, unit):
                unit, end = unit + (more[1].strip() or "*") + more[2], more.end()
        try:
            self.literals[f"_{len(self.literals)}"] = finite(unit_registry().Quantity(number, unit_of(unit)))
        except ValueError as reason:
            name = WORD_HERE.match(unit)
            if name and (name[0] in self.known or name[0] in RESERVED):
                raise ValueError(f"write {number:g}*{name[0]} with a sign between them") from None
            raise ValueError(str(reason)) from None
        return end

    def _goes_on(self, more: re.Match[str], unit: str) -> bool:
        """Whether the text after a unit belongs to it and is not a parameter."""
        name = WORD_HERE.match(more[2])
        if name is None or name[0] in RESERVED or self.text[more.end() :].startswith("("):
            return False
        try:
            unit_of(more[2])
        except ValueError:
            return False
        if name[0] in self.known:
            message = f"'{unit}{more[1]}{name[0]}' may mean the unit {name[0]!r} or the parameter of that name"
            raise ValueError(f"{message}; write ({name[0]}) for the parameter, or give it another name")
        return True


@dataclass
class _Walk:
    """Evaluator of a syntax tree of arithmetic, from its leaves."""

    literals: Mapping[str, Any]
    known: Mapping[str, Any]

    def of(self, node: ast.AST) -> Any:
        later: list[ast.BinOp] = []  # nested operations of a long sum or product
        while isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            later.append(node)
            node = node.left
        value = self._of_one(node)
        for each in reversed(later):
            value = self._combined(type(each.op), value, self.of(each.right))
        return value

    def _of_one(self, node: ast.AST) -> Any:
        match node:
            case ast.Name(id=name):
                return self._named(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -self.of(operand)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.of(operand)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return finite(power(self.of(left), self.of(right)))
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if arguments:
                return finite(called(name, [self.of(each) for each in arguments]))
        raise SyntaxError

    def _named(self, name: str) -> Any:
        if name in self.literals:
            return self.literals[name]
        if name in CONSTANTS:
            return unit_registry().Quantity(CONSTANTS[name], "")
        if name in FUNCTIONS:
            raise ValueError(f"{name!r} is a function; write {name}(…)")
        if name not in self.known:
            message = unknown_name("a parameter", name, list(self.known))
            try:
                unit_of(name)
            except ValueError:
                raise ValueError(message) from None
            raise ValueError(f"{message}; a unit follows its number: 1 {name}")
        return self.known[name]

    def _combined(self, op: type[ast.AST], a: Any, b: Any) -> Any:
        if op in {ast.Add, ast.Sub}:
            alike(a, b)
        if op is ast.Div and b.magnitude == 0.0:
            raise ValueError("it divides by zero")
        return finite(OPERATORS[op](a, b))


def finite(quantity: Any) -> Any:
    """Return a quantity if it is a finite real number, else raise ValueError."""
    number = quantity.magnitude
    if isinstance(number, complex) or not math.isfinite(number):
        raise ValueError("it comes to no finite number")
    return quantity


def alike(*each: Any) -> None:
    """Refuse quantities of different kinds, also turns and cycles, although both have the dimension 1/s."""
    first = each[0]
    for other in each[1:]:
        if first.dimensionality != other.dimensionality:
            raise ValueError(f"it mixes units: {named(first)} and {named(other)}")
        for one, two in ((first, other), (other, first)):
            if crossed(one._units, "rad/s") and revolutions(two._units):
                raise ValueError(f"it mixes cycles and turns or radians: {named(one)} and {named(two)}")
            if not one._units and revolutions(two._units):
                raise ValueError(f"it mixes units: {named(one)} and {named(two)}")


def named(quantity: Any) -> str:
    """Unit of a quantity as messages show it."""
    return f"'{quantity.units:~P}'" if quantity._units else "a number without a unit"


def power(base: Any, exponent: Any) -> Any:
    """A quantity raised to a number."""
    if not exponent.dimensionless:
        raise ValueError(f"an exponent must be without a unit, not in {named(exponent)}")
    number = float(exponent.m_as(""))
    if abs(number) > MOST_POWER:
        raise ValueError(f"an exponent must be at most {MOST_POWER:g} in size, not {number:g}")
    if base.magnitude == 0.0 and number < 0.0:
        raise ValueError("it divides by zero")
    if base.magnitude < 0.0 and not number.is_integer():
        raise ValueError("it comes to no real number: a power of a negative one")
    return base ** (int(number) if number.is_integer() else number)


def called(name: str, given: list[Any]) -> Any:
    """The value of a function."""
    quantity = unit_registry().Quantity
    if name not in FUNCTIONS:
        raise ValueError(unknown_name("a function", name, FUNCTIONS))
    wanted = {"hypot": 2, "atan2": 2}.get(name, 1)
    if name not in {"min", "max"} and len(given) != wanted:
        raise ValueError(f"{name} takes {wanted} value{'s' * (wanted > 1)}, not {len(given)}")
    if name == "abs":
        return abs(given[0])
    if name == "sqrt":
        return power(given[0], quantity(0.5, ""))
    if name in ALIKE:
        alike(*given)
        unit = given[0]._units
        value = ALIKE[name](*(float(each.m_as(unit)) for each in given))
        return quantity(value, "rad" if name == "atan2" else unit)
    if not given[0].dimensionless or crossed(given[0]._units, "rad/s"):
        raise ValueError(f"{name} takes {'an angle' if name in ANGLES else 'a number'}, not {named(given[0])}")
    number = float(given[0].m_as("rad" if name in ANGLES else ""))
    try:
        value = ANGLES[name](number) if name in ANGLES else NUMBERS[name](number)
    except ValueError:
        raise ValueError(f"{name}({number:.6g}) is no real number") from None
    return quantity(value, "rad" if name.startswith("a") else "")


def checked_parameter_name(name: str) -> str:
    """A name that can stand in expressions."""
    if not re.fullmatch(r"[A-Za-z]\w{0,39}", name, re.ASCII) or name in RESERVED:
        wanted = "must be a name of at most 40 ASCII letters, digits and '_', beginning with a letter"
        raise fault(f"{wanted}, got {shown(name)}" + ", which expressions know already" * (name in RESERVED))
    return name


ParameterName = Annotated[str, AfterValidator(checked_parameter_name)]
Parameter = int | float | str
