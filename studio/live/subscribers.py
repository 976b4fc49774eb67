"""Receivers of the live stage's steps."""

from collections.abc import Callable

from studio.engine.model.frames import StepResult

Callback = Callable[[StepResult], object]


class Subscribers:
    """Callbacks for steps, called on the engine thread, so they must return at once. Safe from any thread."""

    def __init__(self) -> None:
        self._callbacks: tuple[tuple[Callback, bool], ...] = ()

    def add(self, callback: Callback, *, raw: bool) -> Callable[[], None]:
        """Call `callback` with every step of the pipeline; return a function that ends this.

        Args:
            callback: receives the steps.
            raw: also with what cameras see while the solver is being prepared, which has no body.
        """
        one = (callback, raw)
        self._callbacks = (*self._callbacks, one)

        def remove() -> None:
            self._callbacks = tuple(other for other in self._callbacks if other is not one)

        return remove

    def tell(self, result: StepResult) -> None:
        """Report a step of the pipeline."""
        for callback, _ in self._callbacks:
            callback(result)

    def tell_raw(self, result: StepResult) -> None:
        """Report a step without a body."""
        for callback, raw in self._callbacks:
            if raw:
                callback(result)
