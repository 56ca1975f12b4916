"""What a measurement was made on."""

from __future__ import annotations

import datetime
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

from timing import seconds_of

ROOT = Path(__file__).resolve().parent.parent
INSTRUCTION_SETS = ("avx2", "fma", "avx512f", "asimd")


def describe_machine() -> dict[str, Any]:
    """Return the processor, its cores and instruction sets, memory, the system and how busy it is."""
    information = Path("/proc/cpuinfo")
    text = information.read_text() if information.exists() else ""
    model = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    flags = re.search(r"^(?:flags|Features)\s*:(.+)$", text, re.MULTILINE)
    known = flags[1].split() if flags else []
    return {
        "processor": model[1] if model else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "instruction_sets": [name for name in INSTRUCTION_SETS if name in known],
        "memory_bytes": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        "system": f"{platform.system()} {platform.machine()}",
        "busy_share_before": busy_share(),
    }


def busy_share() -> float | None:
    """Return the share of the cores' time that is in use now; None where the system does not say."""
    idle_before = idle_seconds()
    if idle_before is None:
        return None
    elapsed = seconds_of(lambda: time.sleep(2))
    idle = (idle_seconds() or 0.0) - idle_before
    return round(max(0.0, 1 - idle / (elapsed * (os.cpu_count() or 1))), 2)


def idle_seconds() -> float | None:
    """Return how long the cores have been idle since the system started, added up (Linux)."""
    uptime = Path("/proc/uptime")
    return float(uptime.read_text().split()[1]) if uptime.exists() else None


def measured_here(others: dict[str, str] | None = None) -> dict[str, Any]:
    """Tell on what machine, when, and with which versions, the peers' `others` among them."""
    return {
        "machine": describe_machine(),
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "versions": own_versions() | (others or {}),
    }


def own_versions() -> dict[str, str]:
    """Return the versions of surfsig and of what it was built and is run with."""
    versions = {
        "surfsig": metadata.version("surfsig"),
        "surfsig commit": output_of("git", "-C", str(ROOT), "describe", "--always", "--dirty"),
        "Python": platform.python_version(),
        "NumPy": metadata.version("numpy"),
        "Rust": output_of("rustc", "--version").removeprefix("rustc "),
    }
    return {name: version for name, version in versions.items() if version}


def output_of(*command: str) -> str:
    """Return what a command prints, or nothing where it cannot be run."""
    if shutil.which(command[0]) is None:
        return ""
    run = subprocess.run(command, capture_output=True, text=True)
    return run.stdout.strip() if run.returncode == 0 else ""


def import_seconds(runs: int) -> dict[str, list[float]]:
    """Time fresh processes that import surfsig and that do nothing, in turn, after one of each unmeasured."""
    commands = {"surfsig": [sys.executable, "-c", "import surfsig"], "bare": [sys.executable, "-c", ""]}
    seconds: dict[str, list[float]] = {name: [] for name in commands}
    for _ in range(runs + 1):
        for name, command in commands.items():
            seconds[name].append(seconds_of(partial(subprocess.run, command, check=True)))
    return {name: values[1:] for name, values in seconds.items()}
