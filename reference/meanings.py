"""What the keys of a record mean, as its source says."""

import ast
import inspect
from itertools import pairwise

from pydantic import BaseModel


def meanings(record: type[BaseModel]) -> dict[str, str]:
    """Field → the text below it in the source of the record, or of those that it extends.

    Read here alone: pydantic would read all sources whenever kedfem starts, a tenth of a second.
    """
    out: dict[str, str] = {}
    for each in reversed(record.__mro__):
        if not issubclass(each, BaseModel) or each is BaseModel:
            continue
        (found,) = ast.parse(inspect.getsource(each)).body
        if not isinstance(found, ast.ClassDef):
            raise TypeError(f"{each.__name__}: must be a class, got {type(found).__name__}")
        for field, text in pairwise(found.body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(text, ast.Expr):
                out[field.target.id] = str(ast.literal_eval(text.value))
    return out
