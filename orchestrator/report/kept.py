"""Figures that are kept: drawn again only where what they were drawn from has changed.

Beside the figures of a page stands, for each file of `figures`, what its figures were
drawn from: the question and the cases of the study, the code of the whole package, the
libraries that draw, and those tables and files of cases that were read, by their
digests. `Results` notes what is read. Figures stand as they are where all of that is
the same now, and where their images are those that were drawn.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from importlib import metadata
from typing import Any

from orchestrator.report.results import Reads, Results
from orchestrator.report.style import FIGURES, Figure
from orchestrator.runs import case
from orchestrator.runs.files import Folder, canonical_json, digest_text, read_json
from orchestrator.tables import csv

KEPT = f"{FIGURES}/drawn.json"
"""What all figures were drawn from, with their words."""
LIBRARIES = ("jinja2", "matplotlib", "numpy", "pandas", "pillow", "scipy")
"""Libraries that draw, and that make numbers which are drawn."""
ALWAYS = ("scenes", "methods")
"""Tables from which the plan of the study follows, which every figure may ask."""
WORDS = ("name", "title", "caption", "data", "place", "follows", "part", "lead")
"""What is kept of a figure as it is, beside its image."""
ENDINGS = (".svg", "-narrow.svg", ".csv")
"""What follows the name of a figure in those of its files."""
LISTS = ("cases", "tables")
"""What is kept of it as a list."""


@dataclass(frozen=True)
class Drawn:
    """The figures of one file, and what they were drawn from.

    Attributes
    ----------
    figures
        The figures in their order, with their images.
    reads
        What was read to draw them.
    fault
        Why others of the file could not be drawn; empty if all were.
    """

    figures: Sequence[Figure]
    reads: Reads
    fault: str = ""


class Kept:
    """What the directory of a study has of its figures, and whether it is still so.

    Parameters
    ----------
    folder
        The directory.
    results
        The study with its tables, as they are now.
    written
        Digests of those tables that are written already, by name.
    **settings
        What else all of the figures depend on.
    """

    def __init__(
        self,
        folder: Folder,
        results: Results,
        written: Mapping[str, str],
        **settings: bool,
    ) -> None:
        self._folder = folder
        self._results = results
        self._settings = settings
        self._before = read_json(folder.path(KEPT))
        self._now: dict[str, Any] = {}
        self._tables = dict(written)

    def get(self, file: str) -> Drawn | None:
        """Look up the figures of a file, if they are as they would be drawn now.

        Parameters
        ----------
        file
            The name of the file.

        Returns
        -------
        Drawn or None
            The figures with their images; None where they are to be drawn.
        """
        kept: Any = self._before.get(file)
        try:
            drawn_from = kept["from"]
            reads = Reads({*drawn_from["tables"]}, {*drawn_from["cases"]})
            if drawn_from != self.sources(reads):
                return None
            figures = [self._figure(*each) for each in kept["figures"]]
        except (AttributeError, KeyError, OSError, TypeError, ValueError):
            # another program has written it, or the image
            return None
        return Drawn(figures, reads)

    def put(self, file: str, drawn: Drawn) -> None:
        """Put the figures of a file into the directory.

        Parameters
        ----------
        file
            The name of the file.
        drawn
            Its figures. They are to be looked up if all could be drawn.
        """
        listed = []
        for figure in drawn.figures:
            about = {name: getattr(figure, name) for name in (*WORDS, *LISTS)}
            digests = {}
            for ending, content in _files(figure).items():
                self._folder.put(f"{FIGURES}/{figure.name}{ending}", content)
                digests[ending] = sha256(content).hexdigest()
            listed.append((about, digests))
        if not drawn.fault:
            self._now[file] = {"from": self.sources(drawn.reads), "figures": listed}

    def close(self) -> None:
        """Write what all figures that were put were drawn from."""
        text = json.dumps(self._now, ensure_ascii=False, separators=(",", ":"))
        self._folder.put(KEPT, f"{text}\n")

    def sources(self, reads: Reads) -> dict[str, Any]:
        """Describe what figures are drawn from, as it is now.

        Parameters
        ----------
        reads
            What they read.

        Returns
        -------
        dict
            Digests as JSON, which are equal only where all of it is.
        """
        tables = sorted({*reads.tables, *ALWAYS})
        return {
            "study": self._study,
            "tables": {name: self._table(name) for name in tables},
            "cases": {name: self._case(name) for name in sorted(reads.cases)},
        }

    @cached_property
    def _study(self) -> str:
        """A digest of what all figures of the study are drawn from."""
        study, plan = self._results.study, self._results.plan
        errors = study.errors.sha256 if study.errors else None
        used = {
            "study": [study.name, study.text, study.tolerance, errors],
            "cases": dict(plan.ids),
            "code": case.code_of_all(),
            "libraries": {name: metadata.version(name) for name in LIBRARIES},
            "settings": self._settings,
        }
        return digest_text(canonical_json(used))

    def _table(self, name: str) -> str:
        """The digest of a table as it is written; empty where there is none."""
        if name not in self._tables:
            table = self._results.tables.get(name)
            self._tables[name] = "" if table is None else digest_text(csv(table))
        return self._tables[name]

    def _case(self, name: str) -> list[Any]:
        """The digest of the results of a case, and whether it has all of its files."""
        run = self._results.plan.cases[name]
        digest = case.digest_of_results(run, self._results.cases)
        return [digest, case.is_whole(run, self._results.cases)]

    def _figure(self, about: Mapping[str, Any], digests: Mapping[str, str]) -> Figure:
        """A figure with its files; ValueError where one is not what was written."""
        files = dict.fromkeys(ENDINGS, b"")
        for ending, digest in digests.items():
            path = self._folder.path(f"{FIGURES}/{about['name']}{ending}")
            files[ending] = path.read_bytes()
            if sha256(files[ending]).hexdigest() != digest:
                raise ValueError(about["name"])
        words: dict[str, Any] = {name: about[name] for name in WORDS}
        for name in LISTS:
            words[name] = tuple(about[name])
        image, narrow, numbers = (files[ending] for ending in ENDINGS)
        return Figure(
            **words,
            drawing=None,
            image=image,
            narrow_image=narrow,
            numbers=numbers.decode("utf-8"),
        )


def _files(figure: Figure) -> dict[str, bytes]:
    """What is written of a figure, by what follows its name."""
    contents = figure.image, figure.narrow_image, figure.numbers.encode("utf-8")
    files = zip(ENDINGS, contents, strict=True)
    return {ending: content for ending, content in files if content}
