"""Profiles and sieve tables that a study file names, from files or from the study's own text."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError, OrchestratorError
from orchestrator.study import profile, sizes

OWN = (
    *("shape", "height", "slope_deg", "windward", "lee_slope_deg", "brink_radius"),
    *("length", "forms", "spacing"),
)
"""Fields of a bed that a profile has of its own."""


@dataclass
class Profiles:
    """Profiles by the name that the study file gives them.

    Attributes
    ----------
    folder : Path
        Folder of the study file.
    texts : dict
        Text of each, of the study's own table `profiles` at first.
    added : str
        TOML with those that came from files: with it the study's text is whole without them.
    """

    folder: Path
    texts: dict[str, Any]
    added: str = field(default="", init=False)

    def bed(self, bed: dict[str, Any], where: str) -> dict[str, Any]:
        """Fields of a bed whose table names a profile; `where` names the study file.

        Raises
        ------
        InputError
            Naming the file, the line or the field, and the remedy.
        """
        for name in OWN:
            if name in bed:
                raise InputError(
                    f"it has its own {name}",
                    where=f"{where}: bed.profile",
                    remedy=f"leave out bed.{name}",
                )
        name, smoothing = bed["profile"], bed.get("smoothing", 0.0)
        if not isinstance(smoothing, int | float) or not 0 <= smoothing < 1e9:
            smoothing = 0.0  # the model will refuse it
        found = profile.read(self._text(name), Path(name).name, self._place(name), smoothing)
        return {"profile": found, "height": found.height, "slope_deg": round(found.steepest_deg, 2)}

    def sieve(self, name: str, where: str) -> list[list[float]]:
        """The rows of a sieve table that a study file names; `where` names the study file.

        Raises
        ------
        InputError
            Naming the field, the file's line and the remedy.
        """
        try:
            return sizes.of_csv(self._text(name))
        except ValueError as error:
            what = str(error)
        except OSError as error:  # a name that no file can have
            what = error.strerror or "no file"
        except OrchestratorError as error:
            what = error.what.replace("profile", "file")[:200]
        raise InputError(
            f"{name[:80]}: {what}",
            where=f"{where}: grain.sizes",
            remedy="columns diameter_m,fraction: a line for each sieve",
        )

    def _place(self, name: str) -> str:
        return str(self.folder / name)

    def _text(self, name: str) -> str:
        if name not in self.texts:
            self.texts[name] = profile.text_of(self.folder / name)
            head = "" if self.added else "\n[profiles]\n"
            # a JSON string is a TOML string, but for the mark of deletion
            text = json.dumps(self.texts[name], ensure_ascii=False).replace("\x7f", "\\u007f")
            self.added += f"{head}{json.dumps(name)} = {text}\n"
        text = self.texts[name]
        if not isinstance(text, str):
            raise InputError("not a text", where=f"profiles: {name}", remedy="write x_m,z_m ...")
        return text
