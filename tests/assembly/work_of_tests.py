"""Tasks that the tests send to workers: they must be importable by name there, which a test module is not."""

import os
import signal
import threading
import time
from pathlib import Path

import numpy as np

from fieldalign.errors import ArgumentError


def plus_item(data, load):
    return data + load("ten")


def made(value, log=None):
    """An item; each making leaves a line."""
    if log is not None:
        with open(log, "a") as file:
            file.write(f"{os.getpid()}\n")
    return value


def broken():
    raise ArgumentError("this scan is broken")


def fails(data, load):
    kinds = {"ours": ArgumentError("it is\nours"), "other": ZeroDivisionError("by zero"), "exit": SystemExit(3)}
    if data in kinds:
        raise kinds[data]
    return threading.Lock() if data == "no pickle" else load("broken") if data == "item" else load("ten")


def undeclared(data, load):
    return load("other")


def dies_once(data, load):
    """Kills its own process in the one call that finds no marker."""
    number, marker = data
    if number == 3 and not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number + int(load("data").sum())


def kills(data, load):
    if data == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.02)
    return data


def dies(*_):
    os._exit(1)


def waits(data, load):
    time.sleep(data)
    return os.getpid()


def ones():
    """Data that is too much to travel with each task."""
    return np.ones(20_000)
