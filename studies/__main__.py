"""``python -m studies NAME``: run a study of the laboratory; without a name, list them."""

from flows.cli import run_to_end
from flows.parser import build_parser
from studies.commands import COMMANDS

app = build_parser(COMMANDS, "Studies of the laboratory, beside what makes and audits a dataset.")

if __name__ == "__main__":
    run_to_end(app)
