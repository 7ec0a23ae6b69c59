"""Command lines that a student wrote: a `%%file NAME.yaml` cell of `entry: words after --ros-args` lines."""

from __future__ import annotations

import itertools
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from autograder.checks import current
from autograder.core import student_yaml
from autograder.core.student_yaml import YAML_REFUSED
from autograder.graph.names import nearest
from autograder.reasons import Group, Kind, Refused

UNANSWERED = Kind("unanswered", "the line is missing, empty or still `?`", Group.FILES)
COMMAND_LINE = Kind("command-line", "the words are no list of ROS arguments", Group.FILES)

_WITH_A_WORD = {
    "-r", "--remap", "-p", "--param", "--params-file", "-e", "--enclave",
    "--log-level", "--log-config-file", "--log-file-name",
}  # fmt: skip
_ALONE = {f"--{how}-{which}-logs" for how in ("enable", "disable") for which in ("rosout", "stdout", "external-lib")}
_LONGEST = 2000


@dataclass(frozen=True)
class CommandLine:
    """One entry of the file; it is read when a program is started with it."""

    file: str
    entry: str
    then: tuple[str, ...] = ()
    """Words that the course adds after the student's."""
    keep: Callable[[str, str], bool] | None = None
    """Which options with a word of theirs are kept, such as `-r` and its rule; all without it."""

    def words(self) -> list[str]:
        """The words after `--ros-args`.

        Raises:
            Refused: there is no such entry, or it holds something else than ROS arguments.
        """
        text = self._text()
        example = f"`{self.entry}: -r camera:=front_camera`"
        try:
            given = shlex.split(text)
        except ValueError as error:
            raise Refused(COMMAND_LINE(f"`{self.entry}` in `{self.file}`: {error}.")) from None
        words = _ros_arguments(given)
        if not words:
            raise Refused(UNANSWERED(f"`{self.entry}` in `{self.file}` has no words.", f"Write {example}."))
        option = ""  # the one that the next word belongs to
        for before, word in itertools.pairwise(["", *words]):
            if (word in _WITH_A_WORD or word in _ALONE) == bool(option):
                raise Refused(
                    COMMAND_LINE(
                        f"`{self.entry}` in `{self.file}` is not a list of ROS arguments: `{word}` is not expected"
                        " there.",
                        "There is no space beside `:=`."
                        if before.endswith(":=") or word.startswith(":=")
                        else "Leave out `ros2 run` and all that stands before the words after `--ros-args`."
                        if "ros2" in given or "--ros-args" in given
                        else f"Every rule has its own `-r`, every parameter its own `-p`: {example}.",
                    )
                )
            option = "" if option or word in _ALONE else word
        if option:
            raise Refused(COMMAND_LINE(f"`{self.entry}` in `{self.file}` ends with `{words[-1]}`."))
        return [*self._kept(words), *self.then]

    def _kept(self, words: list[str]) -> list[str]:
        if self.keep is None:
            return words
        pairs = [(option, word) for option, word in itertools.pairwise(words) if option in _WITH_A_WORD]
        return [word for pair in pairs if self.keep(*pair) for word in pair]

    def _text(self) -> str:
        try:
            table = student_yaml.read(current.check.use(self.file), table=True)
        except Refused as error:
            raise Refused(replace(error.reason, hint=error.reason.hint or "Write `entry: words`.")) from None
        if table and not isinstance(table, dict):
            raise Refused(
                UNANSWERED(
                    f"In `{self.file}` nothing begins with `{self.entry}:`, so the words there belong to no line.",
                    f"Write `{self.entry}:` in front of the words.",
                )
            )
        text = table.get(self.entry) if table else None
        if text is None or text == "?":
            near = nearest(self.entry, map(str, table)) if table and text is None else None
            raise Refused(
                UNANSWERED(
                    f"`{self.entry}` in `{self.file}` has no answer yet."
                    + (f" `{near[:60]}` is there; did you mean `{self.entry}`?" if near else ""),
                )
            )
        if isinstance(text, student_yaml.Twice):
            raise Refused(YAML_REFUSED(f"`{self.entry}` in `{self.file}` {text}."))
        if not isinstance(text, str) or len(text) > _LONGEST:
            raise Refused(
                COMMAND_LINE(
                    f"`{self.entry}` in `{self.file}` is not a command line.",
                    "Write the words in one line, as you would type them, without brackets and commas.",
                )
            )
        return text


def _ros_arguments(words: list[str]) -> list[str]:
    """Leave out `--ros-args` and `--`, because rcl reads `--ros-args … -- --ros-args …` as one list."""
    kept: list[str] = []
    for word, after in itertools.pairwise([*words, "--ros-args"]):
        marks = word == "--ros-args" or (word, after) == ("--", "--ros-args")
        if not marks or (kept and kept[-1] in _WITH_A_WORD):
            kept.append(word)
    return kept


def command_line(
    file: str, entry: str, *, then: Sequence[str] = (), keep: Callable[[str, str], bool] | None = None
) -> CommandLine:
    """The words that a student wants after `--ros-args`, for `launch(…, ros_arguments=…)`.

    Args:
        file: the student's `%%file` of `entry: words` lines.
        entry: which of them.
        then: words that follow the student's.
        keep: asked for each option and its word, such as `-r` and `old:=new`, whether they are kept: what one mistake
            ends can be looked at without it.
    """
    return CommandLine(file, entry, tuple(then), keep)
