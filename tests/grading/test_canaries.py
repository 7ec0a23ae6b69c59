"""Known answers among a class: unseen, bounded, recorded nowhere; where one flips, no grade is written."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Generator, Sequence
from pathlib import Path

import kill_matrix
import pytest
import toy
from places import ROOT

from autograder.authoring.lint.runs import run_findings
from autograder.authoring.lint.static import read_findings
from autograder.core.errors import KitError
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import ClassRun, grade_class, try_class
from autograder.gradebook.grades import read_grades
from autograder.grading import executors
from autograder.grading.canaries import Canaries, known_answers, wrong_answers
from autograder.grading.class_runner import run_class
from autograder.grading.executors import EXECUTORS, Local
from autograder.grading.job import Job
from autograder.grading.runner import Settings
from autograder.grading.supervisor import unknown

WRONG = """
- {answer: talker, instead_of: "print('hello')", write: "raise SystemExit(3)", points: {check_talker: 0}}
- {answer: answers, instead_of: "42", write: "41", points: {check_answers: 0}}
"""
ALONE = Settings(isolation=Isolation.NONE, jobs=1)
Changed = Callable[[int, SubmissionResult], SubmissionResult]


class Course:
    """A toy course with known answers, whose executor notes what it is given and may be meddled with."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = toy.make_course(root)
        self.class_ = root.parent / "class"
        self.paths = CoursePaths(self.root)
        self.given: list[Job] = []
        """The jobs of the last run, in their order."""
        self.meddle: Changed = lambda _, result: result
        """What becomes of a result, by how many jobs of the run came before it."""
        self.begin: Callable[[str], None] = lambda _: None
        """What happens when the job of that name begins."""
        course = self

        class Noting(Local):
            def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult]:
                course.given = list(jobs)

                def begin(name: str) -> None:
                    course.begin(name)
                    started(name)

                for number, result in enumerate(super().run(jobs, begin)):
                    yield course.meddle(number, result)

        monkeypatch.setitem(EXECUTORS, "local", lambda _, settings: Noting(settings.at_once))
        self.wrong_answers(WRONG)

    @property
    def lab(self) -> Lab:
        return load_lab(self.root, toy.LAB)

    def wrong_answers(self, text: str) -> None:
        path = self.paths.canaries(toy.LAB)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def check_answers(self, source: str) -> None:
        """Give the lab another check of its table."""
        notebook = self.paths.solutions / toy.LAB / f"{toy.LAB}.ipynb"
        raw = json.loads(notebook.read_text(encoding="utf-8"))
        cell = next(c for c in raw["cells"] if c["metadata"].get("nbgrader", {}).get("grade_id") == "check_answers")
        cell["source"] = source
        notebook.write_text(json.dumps(raw), encoding="utf-8")

    def hand_in(self, *students: str) -> None:
        sources = {"talker": "%%node talker\nprint('hello')\n", "answers": "%%file answers.yaml\nanswer: 42"}
        for student in students:
            toy.hand_in(self.class_, student, self.lab.clean_notebook(sources)["cells"])

    def grade(self, settings: Settings = ALONE) -> ClassRun:
        self.given = []
        return grade_class(self.root, toy.LAB, self.class_, settings)

    def job(self, name: str) -> Job:
        """The job of that name."""
        return next(job for job in self.given if job.student == name)

    @property
    def names(self) -> list[str]:
        """Who was run: a student, or `?`."""
        return [job.student if (self.class_ / job.student).exists() else "?" for job in self.given]

    def files(self, folder: Path) -> set[str]:
        return {path.stem for path in (folder / toy.LAB).glob("*.json")}

    def recorded(self) -> dict[str, float]:
        return {grade.student: grade.score for grade in read_grades(self.root, toy.LAB)}


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    return Course(tmp_path / "course", monkeypatch)


@pytest.fixture
def judged(course: Course, monkeypatch: pytest.MonkeyPatch) -> Course:
    """The same without running anything, and in order: `toy.judge` says what a job comes to, for large classes."""

    class InOrder:
        def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult]:
            course.given = list(jobs)
            for number, job in enumerate(jobs):
                started(job.student)
                yield course.meddle(number, toy.judge(job))

    monkeypatch.setitem(EXECUTORS, "local", lambda *_: InOrder())
    course.wrong_answers(WRONG.replace("raise SystemExit(3)", "print('no')"))
    return course


def all_full(result: SubmissionResult) -> SubmissionResult:
    """What an executor makes of a result that takes every check for passed."""
    return result.model_copy(
        update={"checks": [check.model_copy(update={"points": check.max_points}) for check in result.checks]}
    )


def none_full(result: SubmissionResult) -> SubmissionResult:
    """What an executor makes of a result that takes no check for passed."""
    return result.model_copy(update={"checks": [check.model_copy(update={"points": 0.0}) for check in result.checks]})


def test_known_answers_run_among_a_class_and_are_recorded_nowhere(course: Course) -> None:
    course.hand_in("ann", "bob")
    run = course.grade(Settings(isolation=Isolation.NONE))
    assert course.names == ["?", "ann", "bob", "?"]
    first, ann, _, last = course.given
    # A job says nothing of what it is: the same cells, the same files, its own digest and name.
    assert {len({str(job.cells), str(sorted(job.files))}) for job in course.given} == {2}
    assert len({job.digest for job in (first, ann, last)}) == 3
    assert "canar" not in first.model_dump_json() + last.model_dump_json()
    # For each check one of the two is right, and the other one is wrong.

    assert ["print('hello')" in job.files["talker.py"] for job in (first, last)] == [False, True]
    assert ["42" in job.files["answers.yaml"] for job in (first, last)] == [True, False]
    assert [result.student for result in run.results] == ["ann", "bob"]
    assert course.files(course.paths.results) == {"ann", "bob"}
    assert course.recorded() == {"ann": 5.0, "bob": 5.0}
    there = [str(path) for path in course.root.rglob("*")] + [course.paths.grades.read_text()]
    assert not [text for text in there for job in (first, last) if job.student in text]
    (sentence,) = run.canaries
    assert "2 notebooks with known answers ran among the class. Each check gave them the points" in sentence
    assert "% of the running time" in sentence
    # What has run and counts is not run again, and neither are known answers beside nothing.
    assert course.grade().canaries == []
    assert course.given == []


@pytest.mark.parametrize(
    ("students", "groups"), [(1, [1, 1, 1]), (39, [1, 39, 1]), (40, [2, 40, 2]), (60, [2, 30, 2, 30, 2])]
)
def test_a_class_has_as_many_as_a_tenth_of_it_but_at_least_a_pair(
    judged: Course, students: int, groups: list[int]
) -> None:
    known, lab = known_answers(judged.root, judged.lab), judged.lab
    names = [f"s{number}" for number in range(students)]
    jobs = {
        name: Job(student=name, lab=lab.name, digest="", isolation=Isolation.NONE, seed=1, files={}, cells=[])
        for name in names
    }
    canaries = Canaries(lab, known, ALONE)
    mixed = [job.student for job in canaries.among(jobs)]
    assert [name for name in mixed if name in jobs] == names
    expected = [number % 2 == 0 for number, count in enumerate(groups) for _ in range(count)]
    assert [name not in jobs for name in mixed] == expected


def test_a_wrong_answer_that_passes_towards_the_end_stops_the_run_before_any_grade(
    course: Course, tmp_path: Path
) -> None:
    """The check itself sees the machine: a file that comes while the class runs."""
    flag = tmp_path / "flag"
    course.check_answers(
        f"import os\nwith answers('answers.yaml') as table:\n"
        f"    table.expect_answer('answer', 41 if os.path.exists({str(flag)!r}) else 42)\ntable.score(2)"
    )
    course.hand_in("ann", "bob")

    def touch(name: str) -> None:
        if name == course.given[-1].student:
            flag.touch()

    course.begin = touch
    with pytest.raises(KitError) as error:
        course.grade()
    assert "No grade was written" in error.value.what
    assert "`check_answers` at the end: a wrong answer must get 0 points, and got 2 of 2" in error.value.what
    assert "`check_talker`" not in error.value.what
    for advice in ("top", "autograder doctor", "--jobs 1", "0 can be believed", "2 will be", "--despite-canaries"):
        assert advice in error.value.do
    assert course.recorded() == {}
    assert not course.paths.grades.exists()
    assert course.files(course.paths.results) == set()
    flag.unlink()
    course.begin = lambda _: None
    # What ran beside it is doubtful: it runs again, and so do the known answers.
    assert course.grade().canaries
    assert sorted(course.names) == ["?", "?", "ann", "bob"]
    assert course.recorded() == {"ann": 5.0, "bob": 5.0}


def test_a_right_answer_that_fails_is_told_with_its_reason(course: Course) -> None:
    course.check_answers("with answers('answers.yaml') as table:\n    table.expect_answer('answer', 7)\ntable.score(2)")
    course.hand_in("ann")
    with pytest.raises(KitError, match=r"a right answer must get 2 points, and got 0 of 2\. Its reason: .*answer"):
        try_class(course.root, toy.LAB, course.class_, ALONE)  # what `--diff` does
    assert course.files(course.paths.doubtful) == {"ann"}


def test_a_person_may_go_on_in_spite_of_it_and_nothing_is_run_again(judged: Course) -> None:
    judged.hand_in("ann", "bob")
    judged.meddle = lambda _, result: all_full(result)
    with pytest.raises(KitError, match="No grade was written"):
        judged.grade()
    run = judged.grade(Settings(isolation=Isolation.NONE, despite_canaries=True))
    assert judged.given == []
    assert judged.recorded() == {"ann": 5.0, "bob": 5.0}
    assert run.canaries == []  # none ran
    judged.hand_in("cem")
    run = judged.grade(Settings(isolation=Isolation.NONE, despite_canaries=True))
    assert set(judged.recorded()) == {"ann", "bob", "cem"}
    assert "2 of their 4 checks gave other points than they must" in run.canaries[0]


@pytest.mark.parametrize(
    ("broken", "moments", "believed"),
    [
        (range(2), {"at the beginning"}, range(30, 60)),
        (range(32, 34), {"in the middle"}, []),
        (range(50, 66), {"at the end"}, range(30)),
    ],
)
def test_only_what_ran_beside_a_flip_is_doubtful(
    judged: Course, broken: Sequence[int], moments: set[str], believed: Sequence[int]
) -> None:
    """An executor that takes everything for passed for a while."""
    names = [f"s{number:02}" for number in range(60)]
    notebooks = {name: toy.hand_in(judged.class_, name, judged.lab.clean_notebook({})["cells"]) for name in names}
    judged.meddle = lambda number, result: all_full(result) if number in broken else result
    canaries = Canaries(judged.lab, known_answers(judged.root, judged.lab), ALONE)
    run_class(notebooks, judged.root, judged.lab, ALONE, lambda _: None, canaries=canaries)
    assert {flip.moment for flip in canaries.flips} == moments
    assert judged.files(judged.paths.results) == {names[number] for number in believed}
    assert judged.files(judged.paths.doubtful) == set(names) - {names[number] for number in believed}
    judged.meddle = lambda _, result: result
    again = Canaries(judged.lab, known_answers(judged.root, judged.lab), ALONE)
    run_class(notebooks, judged.root, judged.lab, ALONE, lambda _: None, canaries=again)
    assert [name for name in names if name in judged.names] == [
        name for number, name in enumerate(names) if number not in believed
    ]
    assert judged.files(judged.paths.results) == set(names)


def starved(result: SubmissionResult) -> SubmissionResult:
    """What a result becomes if its first check lost its points while others kept its programs from the CPUs."""
    first, *rest = result.checks
    lost = first.model_copy(update={"points": 0.0, "starved": 2.0})
    return result.model_copy(update={"checks": [lost, *rest]})


def test_a_flip_among_checks_that_ran_again_makes_all_doubtful_that_ran_again(judged: Course) -> None:
    """The first submission ran at another time than the last canary, but their checks ran again at the same time."""
    names = [f"s{number:02}" for number in range(60)]
    notebooks = {name: toy.hand_in(judged.class_, name, judged.lab.clean_notebook({})["cells"]) for name in names}
    canary = ""

    def meddle(number: int, result: SubmissionResult) -> SubmissionResult:
        nonlocal canary
        if len(result.checks) == 1:
            return none_full(result) if result.student == canary else result
        if result.student not in names and number > 40 and result.checks[0].points:
            canary = result.student  # a right answer to the first check, at the end of the class
        return starved(result) if result.student in (names[0], canary) else result

    judged.meddle = meddle
    canaries = Canaries(judged.lab, known_answers(judged.root, judged.lab), ALONE)
    run_class(notebooks, judged.root, judged.lab, ALONE, lambda _: None, canaries=canaries)
    assert [flip.right for flip in canaries.flips] == [True]
    doubtful = judged.files(judged.paths.doubtful)
    assert names[0] in doubtful and names[1] not in doubtful


def test_what_nobody_could_find_out_of_a_known_answer_is_no_flip(judged: Course) -> None:
    judged.hand_in("ann")
    judged.meddle = lambda _, result: (
        result
        if result.student == "ann"
        else unknown(next(j for j in judged.given if j.student == result.student), "?")
    )
    (sentence,) = judged.grade().canaries
    assert "could not find out about 4 of their 4 checks" in sentence
    assert judged.recorded() == {"ann": 5.0}


def test_the_switch_turns_them_off(judged: Course) -> None:
    judged.hand_in("ann")
    run = judged.grade(Settings(isolation=Isolation.NONE, canaries=False))
    assert (judged.names, run.canaries) == (["ann"], [])
    assert judged.recorded() == {"ann": 5.0}


def test_after_an_interruption_the_known_answers_of_the_next_run_decide(judged: Course) -> None:
    judged.hand_in("ann", "bob", "cem")

    def interrupt(number: int, result: SubmissionResult) -> SubmissionResult:
        if number == 3:
            raise KeyboardInterrupt
        return result

    judged.meddle = interrupt
    with pytest.raises(KeyboardInterrupt):
        judged.grade()
    assert judged.files(judged.paths.results) == set()
    assert judged.recorded() == {}
    kept = judged.files(judged.paths.tried)
    assert len(kept) >= 2
    judged.meddle = lambda _, result: result
    judged.grade()
    assert {name for name in judged.names if name != "?"} == {"ann", "bob", "cem"} - kept
    assert judged.names.count("?") == 2
    assert set(judged.recorded()) == {"ann", "bob", "cem"}


def test_a_flip_before_an_interruption_is_told_and_the_results_beside_it_are_run_again(
    judged: Course, capsys: pytest.CaptureFixture[str]
) -> None:
    judged.hand_in("ann", "bob", "cem")

    def meddle(number: int, result: SubmissionResult) -> SubmissionResult:
        if number == 3:
            raise KeyboardInterrupt
        return none_full(result) if number == 0 else result

    judged.meddle = meddle
    with pytest.raises(KeyboardInterrupt):
        judged.grade()
    told = capsys.readouterr().err
    assert "The results of 3 students are doubtful and will be run again, because answers with known points" in told
    assert judged.files(judged.paths.tried) == set()
    judged.meddle = lambda _, result: result
    judged.grade()
    assert {name for name in judged.names if name != "?"} == {"ann", "bob", "cem"}
    assert set(judged.recorded()) == {"ann", "bob", "cem"}


def test_without_wrong_answers_of_its_own_a_course_has_its_blank_notebook(judged: Course) -> None:
    judged.paths.canaries(toy.LAB).unlink()
    judged.hand_in("ann")
    run = judged.grade()
    first, _, last = judged.given
    assert (first.files["answers.yaml"].strip(), last.answers["answers.yaml"]) == ("answer: 42", True)
    assert "the notebook as students receive it" in run.canaries[1]
    judged.meddle = lambda _, result: all_full(result)
    with pytest.raises(KitError, match="a wrong answer must get fewer than 2 points, and got 2 of 2"):
        judged.grade(Settings(isolation=Isolation.NONE, force=True))


def test_a_course_without_solutions_has_none(course: Course, tmp_path: Path) -> None:
    released = tmp_path / "released"
    path = released / "labs" / toy.LAB / f"{toy.LAB}.ipynb"
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps(course.lab.clean_notebook({})), encoding="utf-8")
    assert known_answers(released, load_lab(released, toy.LAB)) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: [", "is not valid YAML"),
        ("- {answer: talker, write: x, points: {check_talker: 0}}", "entry 1, `instead_of`: Field required"),
        (WRONG.replace("answer: talker", "answer: talkr"), "the lab has no answer `talkr`; it has talker"),
        (WRONG.replace("print('hello')", "print('hallo')"), "occurs 0 times in the solution of `talker`"),
        (WRONG.replace("check_talker", "check_talkr"), "the lab has no check `check_talkr`"),
        (WRONG.replace("check_talker: 0", "check_talker: 3"), "a wrong answer must get fewer"),
        (WRONG.replace("check_talker: 0", "check_answers: 0"), "entry 2: an earlier entry also names `check_answers`"),
    ],
)
def test_what_is_wrong_with_the_file_is_told(course: Course, text: str, said: str) -> None:
    course.wrong_answers(text)
    with pytest.raises(KitError, match=said.replace("(", r"\(")):
        wrong_answers(course.root, course.lab)
    assert any(said in str(one) and not one.warning for one in read_findings(course.root, toy.LAB))


def test_a_broken_file_stops_a_class_before_it_is_taken_in_and_the_switch_is_named(course: Course) -> None:
    course.hand_in("ann")
    course.wrong_answers("a: [")
    for run in (grade_class, try_class):
        with pytest.raises(KitError, match="is not valid YAML") as refused:
            run(course.root, toy.LAB, course.class_, ALONE)
        assert "--no-canaries" in refused.value.do and not course.paths.submitted.exists()


def test_lint_says_what_grading_would_say_of_entries_that_change_one_place(course: Course) -> None:
    notebook = course.paths.solutions / toy.LAB / f"{toy.LAB}.ipynb"
    raw = json.loads(notebook.read_text(encoding="utf-8"))
    check = 'with answers("answers.yaml") as table:\n    table.expect_answer("answer", 42)\ntable.score(1)'
    raw["cells"].append(toy.cell("code", check, 11, grade_id="check_more", grade=True, locked=True, points=1))
    notebook.write_text(json.dumps(raw), encoding="utf-8")
    course.wrong_answers(WRONG + "- {answer: talker, instead_of: print('hello'), write: x, points: {check_more: 0}}\n")
    assert any("change the same place" in str(one) for one in read_findings(course.root, toy.LAB) if not one.warning)


def test_lint_says_which_check_has_no_wrong_answer_and_which_gets_other_points(course: Course) -> None:
    first = WRONG.strip().splitlines()[0]
    course.wrong_answers(first.replace("check_talker: 0", "check_talker: 1"))
    told = [str(one) for one in read_findings(course.root, toy.LAB)]
    assert "warning: cell `check_answers`: canaries.yaml has no wrong answer for it." in told
    known = known_answers(course.root, course.lab)
    found = [str(one) for one in run_findings(course.lab, Isolation.NONE, 4, known)]
    assert any("check_talker`: the wrong answer of canaries.yaml must get 1 point, and gets 0." in one for one in found)
    course.paths.canaries(toy.LAB).unlink()
    assert any("no wrong answers are known" in str(one) for one in read_findings(course.root, toy.LAB))


def test_the_command_says_what_flipped_and_the_options_do_what_they_say(course: Course) -> None:
    course.wrong_answers(WRONG.replace("check_talker: 0", "check_talker: 1"))
    course.hand_in("ann")

    def command(*options: str) -> subprocess.CompletedProcess[str]:
        program = Path(sys.executable).with_name("autograder")
        line = [program, "grade", toy.LAB, course.class_, "--course", course.root, "--isolation", "none", *options]
        return subprocess.run(line, capture_output=True, text=True)

    refused = command()
    assert refused.returncode == 2
    assert "gradebook" not in refused.stdout  # what intake says comes before
    assert "a wrong answer must get 1 point, and got 0 of 3" in refused.stderr
    assert "Traceback" not in refused.stderr
    assert course.recorded() == {}
    assert command("--despite-canaries").returncode == 0
    assert course.recorded() == {"ann": 5.0}
    quiet = command("--no-canaries", "--force")
    assert quiet.returncode == 0
    assert "Canaries" not in quiet.stdout


@pytest.mark.parametrize("name", kill_matrix.labs())
def test_each_check_of_the_labs_has_a_wrong_answer(name: str) -> None:
    lab = load_lab(ROOT, name)
    named = {check for one in wrong_answers(ROOT, lab) for check in one.points}
    assert named == {check.grade_id for check in lab.checks}


@pytest.mark.complete
@pytest.mark.parametrize("name", kill_matrix.labs())
def test_the_known_answers_of_the_labs_get_the_points_that_they_must(name: str) -> None:
    lab = load_lab(ROOT, name)
    canaries = Canaries(lab, known_answers(ROOT, lab), Settings())
    jobs = canaries.among({})
    results = {
        result.student: result for result in executors.chosen("local", Settings(jobs=2)).run(jobs, lambda _: None)
    }
    assert all(check.points is not None for result in results.values() for check in result.checks)
    for result in results.values():
        canaries.take(result)
    assert [str(flip) for flip in canaries.flips] == []
