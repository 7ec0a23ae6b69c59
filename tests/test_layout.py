"""What holds for the whole tree: its top level, its notebooks, its style, and that it stands on its own."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from foreign import FOREIGN
from places import ROOT

FOLDERS = {"lectures", "labs", "solutions", "autograder", "tests"}
FILES = {"Makefile", "README.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"}
DEMANDED_BY_TOOLS = {
    ".ci",
    ".devcontainer",
    ".github",
    ".gitignore",
    ".pre-commit-config.yaml",
    "course.toml",  # the kit's own: every course has one
    "nbgrader_config.py",
    "pyproject.toml",
    "requirements-dev.lock",
    "requirements.lock",
}
NOT_OURS = {".git", ".venv", "build", "__pycache__", ".pytest_cache", ".mypy_cache", ".ruff_cache", ".hypothesis"}


def tree() -> list[Path]:
    """Return every file that belongs to the project: what git knows or would take, or all where there is no git."""
    listed = subprocess.run(
        ["git", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard"], capture_output=True
    )
    if listed.returncode == 0 and listed.stdout:
        paths = [ROOT / name for name in listed.stdout.decode().split("\0") if name]
    else:
        paths = [path for path in ROOT.rglob("*") if not NOT_OURS & set(path.relative_to(ROOT).parts)]
        paths = [path for path in paths if path.relative_to(ROOT).parts[0] != "gradebook"]
    return sorted(path for path in paths if path.is_file())


ARCHAIC = re.compile(r"\b(shall|for ever|dear|hence|whilst|thereof|hitherto|whence)\b", re.IGNORECASE)
FILES_HERE = tree()
# What sample students hand in may be broken on purpose.
HANDED_IN = ROOT / "tests" / "classes"
NOTEBOOKS = [path for path in FILES_HERE if path.suffix == ".ipynb" and HANDED_IN not in path.parents]


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_the_top_level_is_as_fixed() -> None:
    top = {path.relative_to(ROOT).parts[0] for path in FILES_HERE}
    assert top - DEMANDED_BY_TOOLS == FOLDERS | FILES


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_a_notebook_has_stable_ids_and_no_outputs(path: Path) -> None:
    notebook = nbformat.reads(path.read_text(encoding="utf-8"), as_version=4)
    nbformat.validate(notebook)
    ids = [cell["id"] for cell in notebook.cells]
    assert len(set(ids)) == len(ids)
    grade_ids = [cell.metadata.nbgrader.grade_id for cell in notebook.cells if "nbgrader" in cell.metadata]
    assert len(set(grade_ids)) == len(grade_ids)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


def test_no_file_names_a_package_host_or_a_path_of_somebody_elses() -> None:
    found = []
    for path in FILES_HERE:
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        found += [f"{name(path)}: {hit.group(0)}" for hit in FOREIGN.finditer(text)]
    assert found == []


def test_no_sentence_uses_a_word_that_students_have_to_look_up() -> None:
    """Many of them read English as a second language."""
    found = [
        f"{name(path)}:{number}: {line[:90]}"
        for path in FILES_HERE
        if path.suffix in (".md", ".ipynb", ".py", ".html", ".j2", ".yaml") and path != Path(__file__)
        for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1)
        if ARCHAIC.search(line)
    ]
    assert found == []


def test_the_locks_pin_every_package_with_hashes_and_agree() -> None:
    versions: dict[str, dict[str, str]] = {}
    for lock in ("requirements.lock", "requirements-dev.lock"):
        text = (ROOT / lock).read_text()
        blocks = re.split(r"\n(?=[a-z])", text.strip())
        assert all("--hash=sha256:" in block for block in blocks)
        versions[lock] = {block.split(" ", 1)[0]: block for block in blocks}
    assert versions["requirements.lock"].items() <= versions["requirements-dev.lock"].items()


@pytest.mark.parametrize("path", [path for path in FILES_HERE if path.suffix == ".md"], ids=name)
def test_links_to_files_lead_somewhere(path: Path) -> None:
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)#\s]+)", text):
        if "://" not in target:
            assert (path.parent / target).exists(), target


def test_the_devcontainer_and_the_workflow_can_be_read() -> None:
    import yaml

    text = (ROOT / ".devcontainer" / "devcontainer.json").read_text()
    settings = json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.MULTILINE))
    assert "make setup" in settings["postCreateCommand"]
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())
    commands = [step["run"] for step in workflow["jobs"]["test"]["steps"] if "run" in step]
    assert "bash .ci/run" in commands
    assert any(command.startswith("sudo") and "tests/sandbox/test_sandbox.py" in command for command in commands)
    assert "make test" in (ROOT / ".ci" / "run").read_text()


def test_the_issue_forms_and_the_hooks_can_be_read() -> None:
    import yaml

    for path in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"):
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        if path.stem != "config":
            assert form["name"] and form["description"]
            assert all(field["type"] and field["attributes"]["label"] for field in form["body"])
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0]["hooks"]
    assert {hook["id"] for hook in hooks} == {"ruff-check", "ruff-format", "notebooks"}
    assert all((hook["entry"].startswith(".venv/bin/")) for hook in hooks)


@pytest.mark.parametrize(
    "command",
    [("ruff", "check", "."), ("ruff", "format", "--check", "."), ("mypy", "--strict", "autograder")],
    ids=lambda command: "-".join(command[:2]),
)
def test_the_code_is_clean(command: tuple[str, ...]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, timeout=3600, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_imports_go_downwards_and_in_no_circle() -> None:
    """The contracts stand in pyproject.toml."""
    lint = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([lint, "--no-cache"], cwd=ROOT, capture_output=True, text=True, timeout=3600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_module_has_up_to_500_lines_and_a_function_up_to_60() -> None:
    """What belongs together may stand together; a module beyond that holds more than one concept."""
    long = []
    for path in sorted((ROOT / "autograder").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        functions = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
        long += [f"{name(path)}: {f.name}" for f in functions if (f.end_lineno or 0) - f.lineno >= 60]
        long += [name(path)] * (len(text.splitlines()) > 500)
    assert long == [], "move what is a concept of its own into a module of its own, or delete what is not needed"
