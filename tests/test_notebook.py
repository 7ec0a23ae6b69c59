"""The cell magics in a real IPython shell."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from IPython.core.interactiveshell import InteractiveShell


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[InteractiveShell]:
    monkeypatch.chdir(tmp_path)
    InteractiveShell.clear_instance()
    shell = InteractiveShell.instance()
    shell.run_line_magic("load_ext", "autograder")
    yield shell
    InteractiveShell.clear_instance()


def say(shell: InteractiveShell, cell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert shell.run_cell(cell).success
    return capsys.readouterr().out.strip()


def test_a_node_cell_becomes_a_program(shell: InteractiveShell, capsys: pytest.CaptureFixture[str]) -> None:
    assert say(shell, "%%node talker\nprint('hello')\n", capsys) == "node program talker written"
    assert Path("nodes/talker.py").read_text() == "print('hello')\n"
    assert "talker" not in shell.user_ns
    assert [path.name for path in Path("nodes").iterdir()] == ["talker.py"]


def test_a_new_kernel_knows_no_program_of_the_last_one(shell: InteractiveShell) -> None:
    shell.run_cell("%%node talker\nprint('hello')\n")
    Path("nodes/README").touch()
    shell.run_line_magic("reload_ext", "autograder")
    assert [path.name for path in Path("nodes").iterdir()] == ["README"]


def test_a_file_cell_becomes_a_file(shell: InteractiveShell, capsys: pytest.CaptureFixture[str]) -> None:
    assert say(shell, "%%file camera.yaml\na: 1\n", capsys) == "file camera.yaml written"
    assert Path("nodes/camera.yaml").read_text() == "a: 1\n"


@pytest.mark.parametrize(
    ("cell", "line"),
    [
        ("%%node talker\nx = 1\ndef f(:\n    pass\n", "line 3 of the cell is not Python"),
        ("%%file a.yaml\na: 1\nb: [\n", "line 4 of the cell is not YAML"),
        ("%%file a.json\n{\n", "is not JSON"),
    ],
)
def test_a_defect_is_told_at_once_with_its_line(
    shell: InteractiveShell, capsys: pytest.CaptureFixture[str], cell: str, line: str
) -> None:
    assert line in say(shell, cell, capsys)
    # Written all the same: running it shows the same error that grading shows.
    assert len(list(Path("nodes").iterdir())) == 1


@pytest.mark.parametrize("cell", ["%%node ../x\n1\n", "%%node\n1\n", "%%file a.py\n1\n", "%%node X\n1\n"])
def test_a_bad_name_writes_nothing(shell: InteractiveShell, capsys: pytest.CaptureFixture[str], cell: str) -> None:
    assert "not written" in say(shell, cell, capsys)
    assert not Path("nodes").exists()


def test_each_cell_begins_with_no_findings(shell: InteractiveShell) -> None:
    from autograder.checks import session
    from autograder.results import Outcome, Status

    session.current.outcomes.append(Outcome(status=Status.PASSED, title="left over"))
    shell.run_cell("1")
    assert session.current.outcomes == []
