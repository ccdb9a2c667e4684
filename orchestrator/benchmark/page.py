"""The page of a comparison: one file that needs no other and no network."""

import base64
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib import rc_context

from orchestrator.benchmark import charts
from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.verdict import Verdict
from orchestrator.report import page as study_page
from orchestrator.report import style
from orchestrator.report.figure import Figure


def render(
    pack: Pack,
    verdicts: Sequence[Verdict],
    rows: pd.DataFrame,
    levels: Sequence[dict[str, Any]],
    folder: Path,
) -> str:
    """The page's HTML; the figures are also written into a folder."""
    environment = Environment(
        loader=PackageLoader("orchestrator.benchmark", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    return environment.get_template("comparison.html.j2").render(
        css=(study_page.FOLDER / "page.css").read_text(encoding="utf-8"),
        pack=pack.root.name,
        levels=levels,
        failed=[one for one in verdicts if not one.passed],
        scenes=[_line(one) for one in verdicts],
        figures=list(_figures(pack, verdicts, rows, folder)),
        programs=pack.manifest.get("programs", {}),
        machine=pack.manifest.get("machine", {}),
    )


def _line(one: Verdict) -> dict[str, str]:
    return {
        "scene": one.scene,
        "kind": one.kind,
        "verdict": "passed" if one.passed else "failed",
        "error": _said(100 * one.error, " %"),
        "largest": _said(100 * one.worst, " %"),
        "s": _said(one.seconds),
        "ours, s": _said(one.ours_seconds),
        "ratio": _said(one.ratio),
        "CPU ratio": _said(one.cpu_ratio),
        "MiB": _said(one.peak_mib),
    }


def _said(value: float, unit: str = "") -> str:
    return f"{value:.3g}{unit}" if math.isfinite(value) else ""


def _figures(
    pack: Pack, verdicts: Sequence[Verdict], rows: pd.DataFrame, folder: Path
) -> Iterator[tuple[Figure, str]]:
    with rc_context(style.RC):
        for figure in charts.draw(pack, verdicts, rows):
            assert figure.canvas is not None
            image = style.save(figure.canvas, folder, figure.name)
            yield figure, base64.b64encode(image).decode("ascii")
