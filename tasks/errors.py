"""The exception for user errors: all problems of one input, each a full sentence."""

from collections.abc import Sequence


class InputError(ValueError):
    """The input breaks a rule.

    Parameters
    ----------
    problems
        One sentence per problem: the rule, the value received, the place, and what to do.
    """

    def __init__(self, problems: str | Sequence[str]):
        self.problems: tuple[str, ...] = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))
