"""Two Ray nodes in a network namespace of their own: what test_cluster.py runs by `unshare --net`, in a folder.

Each node has a temp folder of its own, and can be lost as a machine is: all its processes at once.
"""

from __future__ import annotations

import fcntl
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

PORT = 6399
ADDRESS = f"127.0.0.1:{PORT}"
_UP, _SET_FLAGS = 0x1, 0x8914
_PATIENCE_S = 300.0
#: A lost node is found out within seconds, not half a minute.
_SOON = {
    "RAY_health_check_initial_delay_ms": "500",
    "RAY_health_check_period_ms": "500",
    "RAY_health_check_timeout_ms": "2000",
    "RAY_health_check_failure_threshold": "3",
}

COMMON = {"motion": "kinematic", "minutes": 2, "damage_minutes": 1}
SMALL = {"name": "hebbian", "learner.arm_map.shape": [8, 8], "learner.head_map.shape": [8, 8]}
COMPARED = {
    "seeds": 2,
    "every": COMMON,
    "grid": {"damage": ["none", "paper"]},
    "conditions": [SMALL, {"name": "random", "learner": "random"}],
}
OWN = {
    "every": COMMON,
    "ceilings": False,
    "conditions": [
        {"name": how, "learner": {"kind": "far.gaze:Far", "how": how}} for how in ("raises", "well", "crashes")
    ],
}


def loopback_up() -> None:
    """What `ip link set lo up` does, which is not installed everywhere."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, _SET_FLAGS, struct.pack("16sH14x", b"lo", _UP))


class Node:
    """A Ray node of one CPU."""

    def __init__(self, folder: Path, *where: str) -> None:
        self.temp = folder
        folder.mkdir()
        options = [
            "--node-ip-address=127.0.0.1",
            "--num-cpus=1",
            "--object-store-memory=80000000",
            "--disable-usage-stats",
        ]
        with (folder / "ray.log").open("w") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "ray.scripts.scripts", "start", *where, *options, "--block"],
                env={**os.environ, **_SOON, "TMPDIR": str(folder), "XDG_CACHE_HOME": str(folder)},
                stdout=log,
                stderr=log,
            )

    def runs(self) -> set[str]:
        """Keys of cells that are under way on it, or are about to be removed."""
        files = self.temp.glob("somatopy-*/*/*/experiment.toml")
        return {file.parent.name for file in files if not file.parent.name.startswith("training-")}

    def lose(self) -> None:
        """End all its processes, which have no time for anything."""
        for process in [self.process.pid, *descendants(self.process.pid)]:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        self.process.wait()


def descendants(process: int) -> list[int]:
    """Processes that a process has started, and those that these have; Ray's workers are a group of their own each."""
    with suppress(OSError):
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
        return [pid for child in map(int, children) for pid in (child, *descendants(child))]
    return []


@contextmanager
def two_nodes() -> Iterator[list[Node]]:
    """A head and another node; in a short path, since sockets stand in it."""
    loopback_up()
    nodes = []
    with tempfile.TemporaryDirectory(prefix="ray-", ignore_cleanup_errors=True) as short:
        base = Path(short)
        try:
            head = ("--head", f"--port={PORT}", "--include-dashboard=false", f"--temp-dir={base / 'ray'}")
            nodes.append(Node(base / "a", *head))
            until(lambda: answers(PORT), nodes)
            nodes.append(Node(base / "b", f"--address={ADDRESS}"))
            yield nodes
        finally:
            for node in nodes:
                if node.process.poll() is None:
                    node.lose()


def answers(port: int) -> bool:
    with socket.socket() as asking:
        return asking.connect_ex(("127.0.0.1", port)) == 0


def until(there: Callable[[], Any], nodes: list[Node]) -> None:
    end = time.monotonic() + _PATIENCE_S
    while not there():
        for node in nodes:
            assert node.process.poll() is None and time.monotonic() < end, (node.temp / "ray.log").read_text()
        time.sleep(0.01)


def lost_in_mid_study(node: Node, out: Path, found: dict[str, Any]) -> None:
    """Lose a node once some cells have ended and one is under way there."""
    until(lambda: (out / "journal.jsonl").exists() and (out / "journal.jsonl").stat().st_size, [node])
    before = node.runs()
    until(lambda: node.runs() - before, [node])
    found["lost"] = [*(node.runs() - before)]
    node.lose()
    found["ended before"] = [json.loads(line)[0]["key"] for line in (out / "journal.jsonl").read_text().splitlines()]


def main(folder: Path) -> None:
    """Run both studies, the second one with a node that is lost; write to found.json what the tables do not say."""
    from somatopy.studies import planned, study

    found: dict[str, Any] = {}
    with two_nodes() as nodes:
        study(planned(OWN), ray=ADDRESS, out=folder / "own", progress=False)
        found["left"] = [str(path) for node in nodes for path in node.temp.glob("somatopy-*")]
        out = folder / "compared"
        watcher = threading.Thread(target=lost_in_mid_study, args=(nodes[1], out, found), daemon=True)
        watcher.start()
        study(planned(COMPARED), ray=ADDRESS, out=out, progress=False)
        watcher.join(5.0)
    (folder / "found.json").write_text(json.dumps(found))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
