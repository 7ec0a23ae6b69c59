"""Where everything of a course lies: the one place that knows the names in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


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
