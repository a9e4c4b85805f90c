"""Types for the module that cffi makes."""
from typing import Any, Callable, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., Any])

class FFI:
    def callback(self, declaration: str, *, error: Any = ..., onerror: Any = ...) -> Callable[[_Function], _Function]: ...
    def __getattr__(self, name: str) -> Any: ...

ffi: FFI
