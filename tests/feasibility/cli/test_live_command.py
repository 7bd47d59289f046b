"""`coverable live`: the page of a case until Ctrl-C."""

import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

from guards import GUARD_S

from feasibility.cli.main import main

ROOT = Path(__file__).parents[3]


def test_bad_input_is_one_message(capsys):
    assert main(["live", "paper/4z"]) == 2
    assert main(["live", "paper/4a", "--set", "task.cone_deg=400"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "did you mean" in said.err
    assert "task.cone_deg: must lie in 0 .. 180" in said.err


def test_a_page_is_served_until_ctrl_c_which_is_its_end_and_no_fault():
    """Right after a question, too."""
    command = [sys.executable, "-m", "feasibility.cli", "live", "paper/4a", "--no-browser"]
    with subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as child:  # fmt: skip
        line = child.stderr.readline()
        url = re.fullmatch(r"live: (http://127\.0\.0\.1:\d+/\S+/) \(served until Ctrl-C\)\n", line)[
            1
        ]
        session = post(url + "open")["session"]
        reply = post(url + "ask", session=session, number=1, final=True, values={})
        assert reply["status"] in ("deciding", "answered")
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=GUARD_S)
    assert (child.returncode, out, err.strip()) == (0, "", "")


def post(url, **asked):
    request = urllib.request.Request(
        url, data=json.dumps(asked).encode(), headers={"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request, timeout=GUARD_S) as reply:
        return json.loads(reply.read())
