"""Where everything of a course lies: the one place that knows the names in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from autograder.core.errors import KitError
from autograder.course.settings import SETTINGS_FILE
from autograder.setup.places import KIT_FOLDER, ROOT


def course_root(named: Path | None = None) -> Path:
    """Return the course that was named, or else the one that the working folder lies in, or else the kit's own.

    For who works on a course; whose checks are run on what somebody handed in, `trusted_course` says.

    Raises:
        KitError: there is none.
    """
    if named is not None:
        return _named(named)
    for folder in (Path.cwd(), *Path.cwd().parents, ROOT):
        if is_course(folder):
            return folder
    raise KitError(
        "There is no course here: no folder with `solutions` or `labs`.",
        "Run it inside the course's folder, or begin one: autograder new course DIR",
    )


def trusted_course(named: Path | None) -> Path:
    """Return the course whose checks may be run on a notebook: the one that was named, or the kit's own.

    Never what lies beside the notebook, above it, or in the working folder: whoever handed in the notebook may have put
    it there, and check cells are trusted code.

    Raises:
        KitError: there is none.
    """
    own = ROOT / KIT_FOLDER if is_students_kit() else ROOT
    if named is not None:
        return _named(named)
    if not is_course(own):
        raise KitError("The kit was installed without a course of its own.", "Name yours: --course FOLDER")
    return own


def _named(folder: Path) -> Path:
    root = folder.resolve()
    if not is_course(root):
        needs = "It needs a folder `solutions` (or `labs`) with NAME/NAME.ipynb."
        raise KitError(f"There is no course in {root}.", needs)
    return root


def is_students_kit() -> bool:
    """Whether this is the environment of a student's kit, which has no solutions and grades nobody.

    Such a kit has two courses: `labs/`, where the student works, and below `kit/` the labs as they were handed out,
    whose checks are run.
    """
    return is_course(ROOT / KIT_FOLDER)


def book_of_kit() -> Path | None:
    """Return the folder of the lectures in a student's kit; None if this is none, or it came without."""
    folder = ROOT / "lectures"
    return folder if is_students_kit() and (folder / "index.html").is_file() else None


def is_course(folder: Path) -> bool:
    """Whether it has a course's settings, or a lab; many folders called `labs` hold something else."""
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
        """Everything that grading makes."""
        return self.root / "build"

    @property
    def submitted(self) -> Path:
        """What was taken in: `<student>/<lab>/<lab>.ipynb`, as nbgrader wants it."""
        return self.build / "submitted"

    @property
    def autograded(self) -> Path:
        """nbgrader's notebooks with the reports in them."""
        return self.build / "autograded"

    @property
    def feedback(self) -> Path:
        """A page for each student and lab."""
        return self.build / "feedback"

    @property
    def results(self) -> Path:
        """What checking found out: `<lab>/<student>.json`."""
        return self.build / "results"

    def taken(self, lab: str) -> Path:
        """Who is in the class of a lab, and what their learning platform calls them."""
        return self.build / "taken" / f"{lab}.json"

    @property
    def tried(self) -> Path:
        """The same of what has run and does not count yet."""
        return self.build / "tried"

    @property
    def to_run_again(self) -> Path:
        """The same of what has run once, with checks that are to be run again alone."""
        return self.build / "to_run_again"

    @property
    def doubtful(self) -> Path:
        """The same of what ran while a known answer got another verdict than it must."""
        return self.build / "doubtful"

    @property
    def gradebook(self) -> Path:
        """nbgrader's database: apart from what grading can make again, for it holds what people decided."""
        return self.root / "gradebook" / "gradebook.db"

    @property
    def lock(self) -> Path:
        """Held by the grading that is at work."""
        return self.build / "grading.lock"

    @property
    def gradebook_url(self) -> str:
        """The database's address, as SQLAlchemy wants it."""
        return f"sqlite:///{self.gradebook}"

    @property
    def grades(self) -> Path:
        """The table of grades."""
        return self.build / "grades.csv"

    def class_page(self, lab: str) -> Path:
        """The page about a lab's class, for instructors."""
        return self.build / "report" / f"{lab}.html"

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
        """What students get: a folder, and the same as a zip."""
        return self.build / "release"

    @property
    def sample_course(self) -> Path:
        """The course that the sample classes are graded in, so that nobody's gradebook holds sample students."""
        return self.build / "sample"

    def sample_class(self, lab: str) -> Path:
        """Where the sample class of a lab is put together."""
        return self.sample_course / "classes" / lab

    def requirements(self, lab: str) -> Path:
        """What of a lab's text is required, and which check holds it."""
        return self.root / "tests" / "classes" / lab / "requirements.yaml"

    def canaries(self, lab: str) -> Path:
        """Wrong answers to a lab of which it is known how many points they get."""
        return self.root / "tests" / "classes" / lab / "canaries.yaml"

    def submitted_notebook(self, student: str, lab: str) -> Path:
        """The notebook that a student handed in."""
        return self.submitted / student / lab / f"{lab}.ipynb"

    def autograded_notebook(self, student: str, lab: str) -> Path:
        """nbgrader's copy of it with the reports."""
        return self.autograded / student / lab / f"{lab}.ipynb"

    def feedback_page(self, student: str, lab: str) -> Path:
        """What the student gets to read."""
        return self.feedback / student / lab / f"{lab}.html"
