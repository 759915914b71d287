"""Loads the modules and models of jobs on import, in the process that those of a pool are forked from."""

from __future__ import annotations

import gc
import importlib
import os
import signal

signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the server too, which ends the others
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # a process with threads cannot be forked
importlib.import_module("scenelang.web.jobs").warm()
gc.freeze()  # pages that no collection touches stay shared
