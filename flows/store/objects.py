"""The objects under one ``s3://bucket/prefix`` address, and what a store's refusals mean."""

import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import urlsplit

from flows.store.layout import write_atomically
from tasks.errors import InputError

SCHEME = "s3"
AT_ONCE = 8
"""Objects on their way at the same time."""
CONNECT_TIMEOUT, RETRIES, RETRY_FOR = "5s", 4, timedelta(seconds=60)
CREDENTIALS = {"InvalidAccessKeyId", "SignatureDoesNotMatch", "AccessDenied", "ExpiredToken", "InvalidToken",
               "InvalidClientTokenId"}  # fmt: skip


def is_address(location: object) -> bool:
    """Whether a location is an address of an object store, and not a folder."""
    return isinstance(location, str) and "://" in location


class Objects:
    """Objects whose names begin with one prefix; a write is one request, so that an object is whole or absent.

    Parameters
    ----------
    address : ``s3://bucket/prefix``; the server, its region and the credentials come from the environment
        (AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID, ...)

    Raises
    ------
    InputError
        From every method too: the address is none, the package is missing, the bucket does not exist, the
        credentials are refused, or no server answers.
    """

    def __init__(self, address: str):
        try:
            import obstore
            from obstore.store import S3Store
        except ImportError:
            raise InputError(f"{address}: needs the package obstore: pip install 'musync-gs[s3]'") from None
        parts = urlsplit(address)
        prefix = parts.path.strip("/")
        if parts.scheme != SCHEME or not parts.netloc or not prefix or ".." in PurePosixPath(prefix).parts:
            raise InputError(f"{address}: an object store's address must be like s3://bucket/prefix")
        self.address = address
        self._api: Any = obstore
        self._store = S3Store(
            parts.netloc,
            prefix=prefix,
            client_options={
                "allow_http": _find_server().startswith("http://"),
                "connect_timeout": CONNECT_TIMEOUT,
            },
            retry_config={"max_retries": RETRIES, "retry_timeout": RETRY_FOR},
        )

    def sizes(self) -> dict[str, int]:
        """Name and size of every object [B]."""
        with self._explained():
            return {entry["path"]: entry["size"] for chunk in self._api.list(self._store) for entry in chunk}

    def folders(self) -> list[str]:
        """First parts of the names that have more than one, as a listing of folders would show them."""
        with self._explained():
            found = self._api.list_with_delimiter(self._store)["common_prefixes"]
        return sorted(PurePosixPath(name).name for name in found)

    def read(self, name: str) -> bytes | None:
        """Return an object's bytes; None where there is no object."""
        with self._explained():
            try:
                return bytes(self._api.get(self._store, name).bytes())
            except FileNotFoundError as error:
                if "NoSuchBucket" in str(error):
                    raise
                return None

    def write(self, name: str, content: bytes | Path, expected: str | None = None) -> str | None:
        """Write an object; returns its new tag.

        Parameters
        ----------
        name, content : of the object
        expected : tag that the object must have now, "" for none there; None writes over anything. Where it is
            otherwise nothing is written, and None comes back
        """
        mode: Any = "overwrite" if expected is None else "create" if expected == "" else {"e_tag": expected}
        refused = self._api.exceptions.AlreadyExistsError, self._api.exceptions.PreconditionError
        with self._explained():
            try:
                # parts of a killed upload in parts would stay in the bucket, unseen and paid for
                tag: str = self._api.put(self._store, name, content, mode=mode, use_multipart=False)["e_tag"]
            except refused:
                return None
            except FileNotFoundError as error:
                if expected and "NoSuchBucket" not in str(error):
                    return None
                raise
        return tag

    def tag(self, name: str) -> str | None:
        """Return the tag of an object, which changes with its content; None where there is no object."""
        with self._explained():
            try:
                found: str = self._api.head(self._store, name)["e_tag"]
            except FileNotFoundError:
                return None
        return found

    def remove(self, names: Collection[str]) -> None:
        """Remove objects; a missing object is no error."""
        if names:
            with self._explained():
                self._api.delete(self._store, sorted(names))

    def send(self, files: Mapping[str, Path]) -> None:
        """Write several objects from files, by name."""
        self._each(lambda name: self.write(name, files[name]), files)

    def fetch(self, names: Collection[str], folder: Path) -> list[str]:
        """Copy objects into a folder under their names; returns the names that have no object."""
        absent = []

        def bring(name: str) -> None:
            content = self.read(name)
            if content is None:
                absent.append(name)
                return
            target = folder / name
            if not target.resolve().is_relative_to(folder.resolve()):
                raise InputError(f"{self.address}/{name}: leads out of the dataset")
            write_atomically(target, content)

        self._each(bring, names)
        return sorted(absent)

    def as_zarr(self, recorded: Collection[str]) -> Any:
        """The objects as a Zarr store that reads a chunk when it is asked for; a recorded one must be there."""
        from zarr.storage import ObjectStore

        from flows.store.recorded_objects import RecordedObjects

        return RecordedObjects(ObjectStore(self._store, read_only=True), recorded, self.address)

    def _each(self, function: Callable[[str], Any], names: Collection[str]) -> None:
        with ThreadPoolExecutor(AT_ONCE) as pool:
            for _ in pool.map(function, sorted(names)):
                pass

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except (self._api.exceptions.BaseError, FileNotFoundError) as error:
            raise InputError(f"{self.address}: {self._sentence(error)}") from None

    def _sentence(self, error: Exception) -> str:
        text = str(error)
        named = re.search(r"<Code>(\w+)</Code>", text)
        code = named[1] if named else type(error).__name__
        if code == "NoSuchBucket":
            return f"the bucket does not exist at {_find_server()}: create it, or correct the address"
        refused = code in CREDENTIALS or code in {"PermissionDeniedError", "UnauthenticatedError"}
        if refused or "169.254.169.254" in text:  # where credentials are asked for when none are given
            return (
                f"{_find_server()} refuses the credentials ({code}): set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY to"
                " those of somebody who may read and write there"
            )
        if named is None and "HTTP error" in text:
            return f"no object store answers at {_find_server()}: check AWS_ENDPOINT_URL and the network"
        return f"{_find_server()} answers {code}: {text.splitlines()[0]}"


def _find_server() -> str:
    return os.environ.get("AWS_ENDPOINT_URL") or "Amazon S3"
