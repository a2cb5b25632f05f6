"""A task: which function a worker calls, and with what."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Task:
    """`function` is "package.module:name"; it takes the arguments and a `progress`."""

    function: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    """They and the result travel through a pipe: records, arrays, texts, numbers."""
    title: str = "The work"
    """How a sentence about the task begins."""

    @staticmethod
    def of(function: Callable[..., Any], title: str = "The work", **arguments: Any) -> Task:
        """From the function itself; TypeError at once where the arguments do not suit it."""
        inspect.signature(function).bind(progress=None, **arguments)
        return Task(Task.name(function), arguments, title)

    @staticmethod
    def name(function: Callable[..., Any]) -> str:
        """By which a worker finds a function."""
        return f"{function.__module__}:{function.__qualname__}"

    def resolve(self) -> Callable[..., Any]:
        """The function, imported."""
        module, _, name = self.function.partition(":")
        found = getattr(importlib.import_module(module), name)
        assert callable(found), f"{self.function} is not a function"
        return found
