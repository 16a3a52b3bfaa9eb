"""Models in YAML files that come with the package, and user files that build on them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic

from tensegrity.errors import InputError, did_you_mean, quoted
from tensegrity.yaml_model import Document, Location, Model, merge


class PackagedModels(Generic[Model]):
    """A folder of complete YAML descriptions of one model.

    A user's file may state only what differs from the packaged description it names with the key
    ``base``; lists are replaced as a whole. A file that holds nothing but a name means that
    packaged description.
    """

    def __init__(
        self, model: type[Model], folder: Path, kind: str, default_base: Callable[[Any], str]
    ) -> None:
        """``kind`` is what errors call the model; ``default_base`` gives the base of a file's
        content that names none."""
        self._model = model
        self._folder = folder
        self._kind = kind
        self._default_base = default_base
        self._loaded: dict[str, Model] = {}  # models are immutable: sharing them is safe

    def names(self) -> list[str]:
        """Names of the packaged descriptions."""
        return sorted(path.stem for path in self._folder.glob("*.yaml"))

    def load(self, name_or_path: str | Path) -> Model:
        """The packaged description of that name, or the user's file at that path.

        Raises :class:`InputError` with file, line and key.
        """
        text = str(name_or_path)
        is_path = isinstance(name_or_path, Path) or Path(text).name != text or "." in text
        if is_path:
            return self._from_file(Path(name_or_path))
        if text not in self.names():
            raise InputError(
                self._unknown(text),
                hint=f"{did_you_mean(text, self.names())}; a path to your own ends in .yaml",
            )
        return self._from_package(text)

    def _from_package(self, name: str) -> Model:
        if name not in self._loaded:
            document = Document(self._folder / f"{name}.yaml")
            self._loaded[name] = document.model(self._model, document.mapping())
        return self._loaded[name]

    def _from_file(self, path: Path) -> Model:
        document = Document(
            path, root=f"the keys of a {self._kind} or the name of a packaged {self._kind}"
        )
        if isinstance(document.content, str):
            return self._from_package(self._checked(document, document.content, ()))
        changes = dict(document.mapping())
        base = changes.pop("base", None)
        if base is None:
            base = self._default_base(changes)
        else:
            base = self._checked(document, base, ("base",))
        return document.model(self._model, merge(self._from_package(base).model_dump(), changes))

    def _checked(self, document: Document, name: Any, location: Location) -> str:
        if name not in self.names():
            raise document.error(
                self._unknown(name), location, did_you_mean(str(name), self.names())
            )
        return str(name)

    def _unknown(self, name: Any) -> str:
        return f"no packaged {self._kind} is called {quoted(name)}"
