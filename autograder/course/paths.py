"""The paths of all files and folders of a course. Their names are defined only here."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from autograder.core.errors import KitError
from autograder.course.settings import SETTINGS_FILE
from autograder.setup.places import KIT_FOLDER, ROOT


def course_root(named: Path | None = None) -> Path:
    """Return the named course, or else the course around the working folder, or else the kit's own course.

    This is for people who work on a course. Use `trusted_course` to run checks on a submission.

    Raises:
        KitError: there is no course.
    """
    if named is not None:
        return _named(named)
    for folder in (Path.cwd(), *Path.cwd().parents, ROOT):
        if _is_course(folder):
            return folder
    raise KitError(
        "There is no course here: no folder with labs in `solutions` or `labs`.",
        "Run it inside the course's folder, or begin one: autograder new course DIR",
    )


def trusted_course(named: Path | None) -> Path:
    """Return the course whose checks may be run on a notebook: the named course, or else the kit's own.

    A course beside or above the notebook or in the working folder is never used. Check cells are trusted code, and
    whoever handed in the notebook may have put that course there.

    Raises:
        KitError: there is no such course.
    """
    own = ROOT / KIT_FOLDER if is_students_kit() else ROOT
    if named is not None:
        return _named(named)
    if not _is_course(own):
        raise KitError("The kit was installed without a course of its own.", "Name yours: --course FOLDER")
    return own


def _named(folder: Path) -> Path:
    root = folder.resolve()
    if not _is_course(root):
        needs = "It needs a folder `solutions` (or `labs`) with NAME/NAME.ipynb."
        raise KitError(f"There is no course in {root}.", needs)
    return root


def is_students_kit() -> bool:
    """Return whether this is the environment of a student's kit, which has no solutions and cannot grade a class.

    Such a kit has two courses. The student works in `labs/`. The labs below `kit/` are as they were handed out, and
    their checks are run.
    """
    return _is_course(ROOT / KIT_FOLDER)


def built_book() -> Path | None:
    """Return the folder of the lectures as HTML: a student's kit has one, and `make lectures` makes one in a checkout.

    None if there is none.
    """
    folder = ROOT / "lectures" if is_students_kit() else ROOT / "build" / "lectures" / "book"
    return folder if (folder / "index.html").is_file() else None


def _is_course(folder: Path) -> bool:
    """Return whether a folder has a course's settings or a lab. Many folders called `labs` hold something else."""
    return (folder / SETTINGS_FILE).is_file() or any(
        path.stem == path.parent.name for name in ("solutions", "labs") for path in (folder / name).glob("*/*.ipynb")
    )


@dataclass(frozen=True)
class CoursePaths:
    """The files and folders of the course at `root`."""

    root: Path

    @property
    def solutions(self) -> Path:
        """The labs as the instructor wrote them."""
        return self.root / "solutions"

    @property
    def labs(self) -> Path:
        """What students receive, made from the solutions."""
        return self.root / "labs"

    @property
    def build(self) -> Path:
        """Everything that grading creates."""
        return self.root / "build"

    @property
    def submitted(self) -> Path:
        """The submissions, as `<student>/<lab>/<lab>.ipynb`, which is the layout that nbgrader expects."""
        return self.build / "submitted"

    @property
    def autograded(self) -> Path:
        """nbgrader's autograded notebooks, which contain the reports."""
        return self.build / "autograded"

    @property
    def feedback(self) -> Path:
        """The feedback pages, one for each student and lab."""
        return self.build / "feedback"

    @property
    def results(self) -> Path:
        """The results of the checks, as `<lab>/<student>.json`."""
        return self.build / "results"

    def taken(self, lab: str) -> Path:
        """Return the file that records who is in the class of a lab and what the learning platform calls them."""
        return self.build / "taken" / f"{lab}.json"

    @property
    def persons(self) -> Path:
        """The file that remembers the name of each person on a platform, beside the gradebook with these names."""
        return self.gradebook.parent / "persons.json"

    @property
    def tried(self) -> Path:
        """Results of runs that do not count yet, as in `results`."""
        return self.build / "tried"

    @property
    def to_run_again(self) -> Path:
        """Results of first runs with checks that must be run again alone, as in `results`."""
        return self.build / "to_run_again"

    @property
    def doubtful(self) -> Path:
        """Results of runs during which a known answer got a wrong verdict, as in `results`."""
        return self.build / "doubtful"

    @property
    def gradebook(self) -> Path:
        """nbgrader's database, outside `build` because it holds people's decisions, which cannot be made again."""
        return self.root / "gradebook" / "gradebook.db"

    def versions(self, lab: str) -> Path:
        """Return the file that records the versions of a lab that students have received."""
        return self.gradebook.parent / "versions" / f"{lab}.json"

    @property
    def lock(self) -> Path:
        """The lock file that a running grading holds."""
        return self.build / "grading.lock"

    @property
    def gradebook_url(self) -> str:
        """The database's address in the form that SQLAlchemy expects."""
        return f"sqlite:///{self.gradebook}"

    @property
    def grades(self) -> Path:
        """The table of grades."""
        return self.build / "grades.csv"

    def class_page(self, lab: str) -> Path:
        """Return the page about a lab's class, which is for instructors."""
        return self.build / "report" / f"{lab}.html"

    @property
    def appeals(self) -> Path:
        """The appeals that instructors have received, beside the gradebook, which has the answers to them."""
        return self.gradebook.parent / "appeals"

    def sample_students(self, lab: str) -> Path:
        """Return the folder that describes the sample students of a lab."""
        return self.root / "tests" / "classes" / lab

    def bank(self, lab: str) -> Path:
        """Return the folder with anonymous answers of past terms to a lab."""
        return self.root / "bank" / lab

    def bank_checked(self, lab: str) -> Path:
        """Return the file that says with which version the bank of a lab was run, and with which outcome."""
        return self.build / "bank" / f"{lab}.json"

    def answers_page(self, lab: str, cell: str) -> Path:
        """Return the page with all answers to a question, which is for instructors."""
        return self.build / "report" / f"{lab}_{re.sub(r'[^A-Za-z0-9_-]', '-', cell)}.html"

    def viva_page(self, lab: str, student: str) -> Path:
        """Return the sheet for a talk with a student about the student's own run, which is for instructors."""
        return self.build / "viva" / lab / f"{student}.html"

    @property
    def term_page(self) -> Path:
        """The page about all labs of a term, which is for instructors."""
        return self.build / "report" / "term.html"

    @property
    def explained(self) -> Path:
        """Pictures and messages of single submissions."""
        return self.build / "explained"

    @property
    def book(self) -> Path:
        """The lectures as HTML."""
        return self.build / "lectures" / "book"

    @property
    def release(self) -> Path:
        """What students get, as a folder and as a zip."""
        return self.build / "release"

    @property
    def sample_course(self) -> Path:
        """The course in which the sample classes are graded, so that no real gradebook contains sample students."""
        return self.build / "sample"

    def sample_class(self, lab: str) -> Path:
        """Return the folder in which the sample class of a lab is put together."""
        return self.sample_course / "classes" / lab

    def requirements(self, lab: str) -> Path:
        """Return the file that lists the requirements in a lab's text and the check for each of them."""
        return self.root / "tests" / "classes" / lab / "requirements.yaml"

    def canaries(self, lab: str) -> Path:
        """Return the file with wrong answers to a lab and the points that each of them must get."""
        return self.root / "tests" / "classes" / lab / "canaries.yaml"

    def submitted_notebook(self, student: str, lab: str) -> Path:
        """Return the notebook that a student handed in."""
        return self.submitted / student / lab / f"{lab}.ipynb"

    def autograded_notebook(self, student: str, lab: str) -> Path:
        """Return nbgrader's copy of a submitted notebook, which contains the reports."""
        return self.autograded / student / lab / f"{lab}.ipynb"

    def feedback_page(self, student: str, lab: str) -> Path:
        """Return the page with a student's feedback."""
        return self.feedback / student / lab / f"{lab}.html"
