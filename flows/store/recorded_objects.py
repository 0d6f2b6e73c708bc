"""Objects that a manifest records, as Zarr reads them: a missing one is damage, and no black picture."""

from collections.abc import Collection
from typing import Any

from zarr.storage import ObjectStore, WrapperStore

from tasks.errors import InputError


class RecordedObjects(WrapperStore[ObjectStore[Any]]):
    """A store whose recorded objects must be there; Zarr takes an absent object for fill values.

    Parameters
    ----------
    store : of the objects
    recorded : names that must be there
    address : of the store, for the sentence
    """

    def __init__(
        self, store: ObjectStore[Any], recorded: Collection[str] = frozenset(), address: str = ""
    ) -> None:
        super().__init__(store)
        self.recorded, self.address = recorded, address

    async def get(self, key: str, *arguments: Any, **options: Any) -> Any:
        """Return an object's bytes, or None where there is none and none is recorded.

        Raises
        ------
        InputError
            If there is no object and one is recorded.
        """
        found = await super().get(key, *arguments, **options)
        if found is None and key in self.recorded:
            raise InputError(
                f"{self.address}/{key}: missing, with pictures of a clip: musync lab repair makes it again"
            )
        return found
