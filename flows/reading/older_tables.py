"""Stored tables of older datasets, whose files hold NaN where a value is not represented."""

from collections.abc import Sequence
from typing import Any

from pyarrow import dataset

from flows.store.missing import null_missing


class OlderTable(dataset.FileSystemDataset):
    """A lazy pyarrow dataset whose rows have NULL in place of NaN before a filter sees them.

    The files' statistics leave NaN out, so no filter is handed down to them.
    """

    def scanner(
        self, columns: Sequence[str] | None = None, filter: dataset.Expression | None = None, **options: Any
    ) -> dataset.Scanner:
        """Return a scanner over the rows, as `pyarrow.dataset.Dataset.scanner`.

        Parameters
        ----------
        columns, filter, options : as pyarrow takes them
        """
        batches = map(null_missing, super().scanner().to_batches())
        return dataset.Scanner.from_batches(
            batches, schema=self.schema, columns=columns, filter=filter, **options
        )
