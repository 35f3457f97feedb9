"""Shell completion: a script that bash accepts and that knows every command."""

import importlib.util
import subprocess

import pytest

from walking_irl.cli import completion
from walking_irl.cli.main import COMMANDS


@pytest.mark.skipif(
    importlib.util.find_spec("shtab") is None,
    reason="shell completion needs the extra [completion]",
)
def test_bash_accepts_the_script_and_it_knows_every_command(call):
    code, out, _ = call("--print-completion", "bash")
    assert code == 0
    assert "--max-solves" in out
    ask = "COMP_WORDS=(walking-irl ''); COMP_CWORD=1; _shtab_walking_irl; echo ${COMPREPLY[@]}"
    done = subprocess.run(["bash"], input=f"{out}\n{ask}\n", text=True, capture_output=True)
    assert set(COMMANDS) <= set(done.stdout.split()), done.stderr


def test_without_the_package_one_sentence_says_what_to_install(complaint, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "shtab", None)
    assert "walking-irl[completion]" in complaint("--print-completion", "bash")
    assert "bash" in completion.SHELLS
