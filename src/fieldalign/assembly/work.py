"""Work on many items: tasks, what came of them, the items that a process keeps, and the line that tasks stand in."""

from __future__ import annotations

import atexit
import pickle
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple, TypeAlias

from ..errors import ArgumentError, FieldalignError

Load: TypeAlias = Callable[[str], Any]
Function: TypeAlias = Callable[[Any, Load], Any]
Items: TypeAlias = Mapping[str, Callable[[], Any]]
Results: TypeAlias = "Generator[Done, None, None]"

KEPT = 64    # items that a process keeps
_DEATHS = 3  # of workers, until the task that was there each time takes the blame


class Task(NamedTuple):
    """One piece of work. key: its name, unlike any other's. needs: the items that it loads. data: what is its own."""

    key: str
    needs: tuple[str, ...]
    data: Any = None


class Done(NamedTuple):
    """What came of a task: its value, or the sentence that says why there is none."""

    key: str
    value: Any = None
    error: str | None = None


def perform(function: Function, task: Task, load: Load) -> Done:
    """Does a task; whatever is raised in it is its own failure, never the run's."""

    def load_needed(name: str) -> Any:
        if name not in task.needs:  # an executor may have brought no other item here
            raise KeyError(f"{name} is none of the items that {task.key} needs")
        return load(name)

    try:
        return Done(task.key, function(task.data, load_needed))
    except (Exception, SystemExit) as error:
        return Done(task.key, error=sentence_of(error))


def perform_away(function: Function, task: Task, load: Load) -> bytes:
    """As perform(), pickled here: a value that does not pickle is the task's failure, too."""
    done = perform(function, task, load)
    try:
        return pickle.dumps(done, pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # pickling raises anything
        return pickle.dumps(Done(task.key, error=f"its value cannot be sent back: {sentence_of(error)}"))


def sentence_of(error: BaseException) -> str:
    """An exception in one line; of one that is not ours, its kind first."""
    text = " ".join(str(error).split())
    return text if isinstance(error, FieldalignError) and text else f"{type(error).__name__}: {text}".rstrip(": ")


def unsendable(name: str, error: Exception) -> ArgumentError:
    """The error for an item that cannot leave this process."""
    return ArgumentError(
        f"{name} cannot be sent to another process ({sentence_of(error)}): give a path, points or a PointCloud"
    )


class Shelf:
    """The items of one process: each is made once, and those used last are kept. May be asked from several threads."""

    def __init__(self, kept: int = KEPT) -> None:
        self._kept = kept
        self._lock = threading.Lock()
        self._slots: dict[Hashable, _Slot] = {}  # the one used last is the last

    def get(self, name: Hashable, make: Callable[[], Any]) -> Any:
        """The item of a name; `make` is called where it is not here."""
        with self._lock:
            slot = self._slots[name] = self._slots.pop(name) if name in self._slots else _Slot()
            if len(self._slots) > self._kept:
                del self._slots[next(iter(self._slots))]
        return slot.get(make)

    def drop(self, is_over: Callable[[Any], bool] = lambda name: True) -> None:
        """Lets go of the items whose name tells that they are over."""
        with self._lock:
            self._slots = {name: slot for name, slot in self._slots.items() if not is_over(name)}


class _Slot:
    """A place for one item; who comes while it is made waits for it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._item: tuple[Any] | None = None

    def get(self, make: Callable[[], Any]) -> Any:
        with self._lock:
            if self._item is None:
                self._item = (make(),)
            return self._item[0]


HERE = Shelf()  # of a worker's process
atexit.register(HERE.drop)  # native objects that outlive the interpreter are told as leaks


class Line:
    """Tasks on their way to workers that may die. Only some are away at once, so a million tasks need no room.

    Whoever was there when a worker died is under suspicion: it goes again alone, so that no other takes the blame.
    room: how many may be away. away: the tasks that are, by their future.
    """

    def __init__(self, tasks: Iterable[Task], room: int) -> None:
        self.room = room
        self.away: dict[Any, Task] = {}
        self._fresh = iter(tasks)
        self._suspects: deque[Task] = deque()
        self._alone = False  # whether the one task that is away is a suspect
        self._deaths: Counter[str] = Counter()

    def ready(self) -> Iterator[Task]:
        """The tasks that may leave now; each must be sent before the next is asked for."""
        while (task := self._next()) is not None:
            yield task

    def _next(self) -> Task | None:
        if self.away and (self._alone or self._suspects or len(self.away) >= self.room):
            return None
        self._alone = bool(self._suspects)
        return self._suspects.popleft() if self._suspects else next(self._fresh, None)

    def put_back(self, task: Task) -> None:
        """A task that could not be sent; no fault of its own."""
        self._suspects.appendleft(task)

    def back(self, future: Any) -> Task:
        """The task of a future that is over."""
        return self.away.pop(future)

    def died(self, future: Any, deaths: int = 1) -> Iterator[Done]:
        """A task whose worker died: it goes again, unless that was the third death, of which it was alone in one."""
        task = self.back(future)
        self._deaths[task.key] += deaths
        if self._alone and self._deaths[task.key] >= _DEATHS:
            times = self._deaths[task.key]
            yield Done(task.key, error=f"the worker died {times} times (killed, or out of memory) while it did this")
        else:
            self._suspects.append(task)
