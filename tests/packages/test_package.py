"""`autograder package`: the lab's programs and launch files as a package that builds, installs and runs."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import Distribution
from pathlib import Path

import pytest
from places import ROOT
from typer.testing import CliRunner

from autograder.cli.main import app
from autograder.core.errors import KitError
from autograder.course.lab import load_lab
from autograder.launch_files import read_launch_file
from autograder.packages.ament_package import lab_files, package_name, write_package, write_packages

LAB = load_lab(ROOT, "lab3_remapping")
SOLUTION = ROOT / "solutions" / "lab3_remapping" / "lab3_remapping.ipynb"


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package of lab 3's solution."""
    files = {**LAB.given, **{a.file.file_name: _solved(a.solution) for a in LAB.answers.values() if a.file}}
    files["helper.py"] = "WORD = 'helped'\n"
    files["says.py"] = (
        "import sys\n\nfrom helper import WORD\n\nif __name__ == '__main__':\n    print(WORD, sys.argv[1:])\n"
    )
    return write_package("camera_lab", "Lab 3", files, tmp_path_factory.mktemp("src"))


def _solved(cell: str) -> str:
    return "\n".join(cell.split("\n")[1:]) + "\n"


@pytest.fixture(scope="module")
def installed(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package, built as a wheel and installed under a prefix of its own."""
    folder = tmp_path_factory.mktemp("built")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    offline = ["--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*pip, "wheel", *offline, "-w", folder, source], check=True, capture_output=True)
    [wheel] = folder.glob("camera_lab-*.whl")
    prefix = folder / "prefix"
    subprocess.run([*pip, "install", *offline, "--prefix", prefix, wheel], check=True, capture_output=True)
    return prefix


def test_the_index_marker_the_launch_files_and_the_description_are_in_the_share_folder(installed: Path) -> None:
    share = installed / "share"
    assert (share / "ament_index/resource_index/packages/camera_lab").read_text() == ""
    assert {"camera.launch.yaml", "vehicle.launch.yaml"} <= {
        path.name for path in (share / "camera_lab/launch").iterdir()
    }
    root = ET.parse(share / "camera_lab/package.xml").getroot()
    assert root.findtext("name") == "camera_lab"
    assert root.findtext("export/build_type") == "ament_python"
    assert {"rclpy", "ros2launch", "sensor_msgs"} <= {depend.text for depend in root.iter("exec_depend")}


def test_every_program_has_an_entry_point_that_starts_it_as_a_script(installed: Path) -> None:
    [site] = installed.glob("lib/python*/site-packages")
    [info] = site.glob("camera_lab-*.dist-info")
    points = {point.name: point.value for point in Distribution.at(info).entry_points}
    assert points["camera_demo"] == "camera_lab:run_camera_demo"
    environment = {**os.environ, "PYTHONPATH": str(site)}
    checked = "import camera_lab; print([callable(getattr(camera_lab, 'run_' + name)) for name in {names!r}])"
    subprocess.run([sys.executable, "-c", checked.format(names=list(points))], env=environment, check=True)
    ran = subprocess.run(
        [installed / "bin" / "says", "a", "b"], env=environment, check=True, capture_output=True, text=True
    )
    assert ran.stdout == "helped ['a', 'b']\n"


def test_the_installed_launch_file_starts_what_it_starts_in_the_lab(installed: Path) -> None:
    nodes = read_launch_file(installed / "share/camera_lab/launch/vehicle.launch.yaml", {"vehicle": "car"})
    assert [f"{node.namespace}/{node.name}" for node in nodes] == [
        f"/car/{side}_demo" for side in ("right", "left", "rear")
    ]


def test_scripts_go_where_ros2_run_looks_for_them(source: Path) -> None:
    assert "install_scripts=$base/lib/camera_lab" in (source / "setup.cfg").read_text()


def test_the_command_writes_what_students_receive_and_says_how_to_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    ran = CliRunner().invoke(app, ["package", "lab3_remapping", str(tmp_path)])
    assert ran.exit_code == 0, ran.output
    assert "ros2 launch camera_lab vehicle.launch.yaml" in ran.output
    text = (tmp_path / "camera_lab/launch/camera.launch.yaml").read_text()
    assert "YOUR CODE HERE" in text
    with pytest.raises(KitError, match="stays as it is"):
        write_package("camera_lab", "", {"a.py": ""}, tmp_path)


def test_packages_that_a_lab_has_already_stay_as_they_are_beside_that_of_its_programs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    ran = CliRunner().invoke(app, ["package", "lab7_interfaces", str(tmp_path)])
    assert ran.exit_code == 0, ran.output
    assert "--packages-select lab7_interfaces car_horn car_interfaces" in ran.output
    assert {"package.xml", "setup.py", "launch"} <= {path.name for path in (tmp_path / "car_sensors").iterdir()}
    assert (tmp_path / "lab7_interfaces" / "lab7_interfaces" / "count_server.py").is_file()
    for path in (tmp_path / "lab7_interfaces").rglob("*.py"):
        ast.parse(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", [path.parent.name for path in sorted((ROOT / "solutions").glob("lab*/lab*.ipynb"))])
@pytest.mark.parametrize("solved", [False, True])
def test_every_launch_file_names_packages_and_programs_that_are_written(
    path: str, solved: bool, tmp_path: Path
) -> None:
    lab = load_lab(ROOT, path)
    files = lab_files(lab, ROOT / "solutions" / path / f"{path}.ipynb" if solved else None)
    written = write_packages(lab, files, tmp_path)
    for launch in tmp_path.rglob("*.launch.yaml"):
        nodes = re.findall(r"pkg: *\"?(\w+)\"?[,\s]+exec: *\"?(\w+)", launch.read_text(encoding="utf-8"))
        for package, program in nodes:
            if package in written or solved:  # to write the others is what the lab asks for
                setup = (tmp_path / package / "setup.py").read_text(encoding="utf-8")
                assert f'"{program} = ' in setup, (launch, program)
        for beside in re.findall(r"\$\(dirname\)/([\w.]+)", launch.read_text(encoding="utf-8")):
            assert (launch.parent / beside).is_file(), (launch, beside)
    named = {"lab3_remapping": ["camera_lab"], "lab8_bringup": ["car_lab", "porter_lab"], "lab9_delivery": ["delivery"]}
    assert list(written) == named.get(path, [path])


def test_nothing_is_written_where_one_of_the_packages_is_there(tmp_path: Path) -> None:
    lab = load_lab(ROOT, "lab8_bringup")
    (tmp_path / "porter_lab").mkdir()
    with pytest.raises(KitError, match="porter_lab exists already"):
        write_packages(lab, lab_files(lab, None), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["porter_lab"]


def test_the_programs_of_a_notebook_are_taken() -> None:
    files = lab_files(LAB, SOLUTION)
    assert "$(var side)_demo" in files["camera.launch.yaml"]
    assert "YOUR CODE HERE" not in files["camera.launch.yaml"]


def test_a_file_that_is_no_notebook_is_refused_with_a_reason(tmp_path: Path) -> None:
    (tmp_path / "x.ipynb").write_text("no")
    with pytest.raises(KitError):
        lab_files(LAB, tmp_path / "x.ipynb")


def test_a_lab_without_launch_files_is_a_package_of_its_own_name() -> None:
    assert package_name(load_lab(ROOT, "lab2_executors")) == "lab2_executors"
    assert package_name(LAB) == "camera_lab"
