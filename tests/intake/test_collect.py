"""A class that is taken in as it lies: zips and folders, damaged ones, closed ones, links."""

from __future__ import annotations

import os
import shutil
import tempfile
import zipfile
from pathlib import Path

import pytest
import toy

from autograder.core.errors import KitError
from autograder.intake.collect import collect

ORDINARY_USER = 12345


def make_zip(path: Path, members: dict[str, str]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    return path


@pytest.mark.parametrize("form", ["{}/toy.ipynb", "{}/toy/toy.ipynb", "class/{}/toy.ipynb", "{}/toy (1).ipynb"])
def test_a_zip_is_taken_in(tmp_path: Path, form: str) -> None:
    members = {form.format(name): name for name in ("ann", "bob")} | {"__MACOSX/ann/._toy.ipynb": "x"}
    found = collect(make_zip(tmp_path / "in.zip", members), toy.LAB, tmp_path / "course").notebooks
    assert {student: path.read_text() for student, path in found.items()} == {"ann": "ann", "bob": "bob"}


@pytest.mark.parametrize("packing", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
@pytest.mark.parametrize("kept", [0, 12, 40])
def test_a_damaged_member_of_a_zip_stops_nobody_else(tmp_path: Path, packing: int, kept: int) -> None:
    archive = tmp_path / "in.zip"
    with zipfile.ZipFile(archive, "w", packing) as made:
        for student in ("ann", "bob"):
            made.writestr(f"{student}/toy.ipynb", student + "".join(map(str, range(200))))
        packed, size = made.getinfo("ann/toy.ipynb").header_offset, made.getinfo("ann/toy.ipynb").compress_size
    content = bytearray(archive.read_bytes())
    start = packed + 30 + len("ann/toy.ipynb")
    content[start + kept : start + size] = b"\xff" * (size - kept)
    archive.write_bytes(content)
    collected = collect(archive, toy.LAB, tmp_path / "course")
    assert {student: path.read_text()[:3] for student, path in collected.notebooks.items()} == {"bob": "bob"}
    assert len(collected.refused) == 1 and "ann/toy.ipynb" in collected.refused[0]


def test_a_zip_with_a_damaged_directory_is_a_sentence(tmp_path: Path) -> None:
    archive = make_zip(tmp_path / "in.zip", {"ann/toy.ipynb": "ann", "bob/toy.ipynb": "bob"})
    archive.write_bytes(archive.read_bytes().replace(b"PK\x01\x02", b"XX\x01\x02"))
    with pytest.raises(KitError, match="nor a zip that can be read"):
        collect(archive, toy.LAB, tmp_path / "course")


def test_a_folder_that_may_not_be_entered_stops_nobody_else() -> None:
    # Below a folder that everybody may enter, since root has to become somebody else to be refused anything.
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o777)
    toy.hand_in(folder / "in", "ann", "ann")
    closed = toy.hand_in(folder / "in", "bob", "bob").parent
    closed.chmod(0)
    was = os.geteuid()
    os.seteuid(was or ORDINARY_USER)
    try:
        collected = collect(folder / "in", toy.LAB, folder / "course")
        texts = {student: path.read_text() for student, path in collected.notebooks.items()}
    finally:
        os.seteuid(was)
        closed.chmod(0o700)
        shutil.rmtree(folder)
    assert texts == {"ann": "ann"}
    assert len(collected.refused) == 1 and "'bob' cannot be read" in collected.refused[0]


def test_a_zip_cannot_write_elsewhere(tmp_path: Path) -> None:
    members = {"../evil/toy.ipynb": "x", "/abs/toy.ipynb": "x", "a/../../evil/toy.ipynb": "x", "ann/toy.ipynb": "ok"}
    archive = make_zip(tmp_path / "in.zip", members | {"ann/ipykernel_launcher.py": "x", "..\\evil\\toy.ipynb": "x"})
    found = collect(archive, toy.LAB, tmp_path / "course").notebooks
    assert list(found) == ["ann"]
    written = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    ours = ["nbgrader_config.py", "submitted/ann/toy/toy.ipynb", "taken/toy.json"]
    assert written == [*(f"course/build/{name}" for name in ours), "in.zip"]


def test_a_folder_is_taken_in_without_following_links(tmp_path: Path) -> None:
    toy.hand_in(tmp_path / "in", "ann", "ann")
    (tmp_path / "in" / "bob").mkdir()
    secret = tmp_path / "secret.ipynb"
    secret.write_text("secret")
    (tmp_path / "in" / "eve").mkdir()
    (tmp_path / "in" / "eve" / "toy.ipynb").symlink_to(secret)
    (tmp_path / "in" / "mallory").symlink_to(tmp_path)
    toy.hand_in(tmp_path / "in", "*", "glob")
    toy.hand_in(tmp_path / "in" / "__MACOSX", "ann", "what a Mac packs")
    collected = collect(tmp_path / "in", toy.LAB, tmp_path / "course")
    texts = {student: path.read_text() for student, path in collected.notebooks.items()}
    harmless = next(student for student in texts if student not in ("ann", "bob"))
    assert texts == {"ann": "ann", "bob": "", harmless: "glob"} and "*" not in harmless
    assert collected.notes == [f"'*' cannot be a file's name here; the student is called {harmless!r}."]
    told = "\n".join(collected.refused)
    assert len(collected.refused) == 2
    assert "'eve/toy.ipynb', which cannot be read ('toy.ipynb' is a link" in told and "mallory is a link" in told


def test_nothing_to_take_in_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    with pytest.raises(KitError, match="no submissions"):
        collect(tmp_path / "in", toy.LAB, tmp_path)
    with pytest.raises(KitError, match="neither a folder nor a zip"):
        collect(tmp_path / "nothing", toy.LAB, tmp_path)
